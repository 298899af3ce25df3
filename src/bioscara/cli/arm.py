"""The arm that the command line names."""

from __future__ import annotations

from bioscara.cli.arguments import Options
from bioscara.model import ArmParameters
from bioscara.robot import Robot


def open_arm(options: Options, parameters: ArmParameters) -> Robot:
    """Return the arm that ``--bus`` and ``--v1`` name; nothing is opened yet.

    Raises:
        InvalidArgumentError: No bus has such a name.
    """
    if options.bus != "sim":
        return Robot.connect(options.bus, parameters)
    return Robot.simulated(
        parameters,
        v1=options.v1,
        pace_homing=getattr(options, "realtime", False),
        pace_motion=options.paced,
    )
