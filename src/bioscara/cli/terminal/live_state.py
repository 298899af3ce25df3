"""The live table of an arm that no command moves."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from bioscara.cli.motion import limitation_line, tool_line
from bioscara.cli.output.angles import angle_unit
from bioscara.cli.output.console import Output
from bioscara.cli.output.display import make_view
from bioscara.cli.parser import Options
from bioscara.drivers import Quality
from bioscara.report import CycleRecord, JointRecord, Phase, SampleQuality
from bioscara.robot.arm_methods import ArmMethods

_PERIOD = 0.1
"""Time between two readings [s]."""
_QUALITY = {
    Quality.FRESH: SampleQuality.GOOD,
    Quality.STALE: SampleQuality.STALE,
    Quality.UNKNOWN: SampleQuality.UNKNOWN,
}


def show_live(
    robot: ArmMethods, options: Options, output: Output, ended: Callable[[], bool]
) -> None:
    """Show the joints until ``ended``, and each new fault; the arm may be disabled.

    Raises:
        BioscaraError: The joints cannot be read.
    """
    angles, begin = angle_unit(options), robot.state.time
    units = [(joint.name, joint.unit) for joint in robot.parameters.joints]
    pose = tool_line(robot, angles)
    view = make_view(output, units, angles, lambda record: [*pose(record), *limitation_line(robot)])
    shown = 0
    try:
        while not ended():
            view.cycle(_record(robot, begin))
            faults = robot.faults
            for fault in faults[shown:]:
                view.note(f"fault: {fault}")
            shown = len(faults)
            time.sleep(_PERIOD)
    finally:
        view.close()


def _record(robot: ArmMethods, begin: float) -> CycleRecord:
    state = robot.state
    return CycleRecord(
        phase=Phase.WATCHING,
        start=state.time - begin,
        trajectory_time=math.nan,
        bus_time=0.0,
        retries=0,
        late=0.0,
        joints=tuple(
            JointRecord(
                time=stamp - begin,
                reference=math.nan,
                reference_velocity=math.nan,
                position=position,
                velocity=velocity,
                flags=flags,
                quality=_QUALITY[quality],
                load=math.nan,
            )
            for flags, stamp, position, velocity, quality in zip(
                robot.flags,
                state.stamps,
                state.positions,
                state.velocities,
                state.qualities,
                strict=True,
            )
        ),
    )
