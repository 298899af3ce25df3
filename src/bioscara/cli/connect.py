"""The arm that the command line names."""

from __future__ import annotations

from pathlib import Path

from bioscara.cli.arguments import Options
from bioscara.model import ArmParameters
from bioscara.robot import FAULTS, Robot


def open_arm(options: Options, parameters: ArmParameters, evidence: Path = FAULTS) -> Robot:
    """Return the arm that ``--bus`` and ``--v1`` name; nothing is opened yet.

    Args:
        options: Parsed options.
        parameters: Parameters of the arm.
        evidence: Folder for the flight records of faults.

    Raises:
        InvalidArgumentError: There is no bus of that name.
    """
    if options.bus != "sim":
        return Robot.connect(
            options.bus,
            parameters,
            evidence=evidence,
            full_speed=getattr(options, "full_speed", False),
        )
    return Robot.simulated(
        parameters,
        v1=options.v1,
        evidence=evidence,
        full_speed=getattr(options, "full_speed", False),
        pace_homing=getattr(options, "realtime", False),
        pace_motion=options.paced,
    )
