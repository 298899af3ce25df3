"""Samples of the arm's state, taken in the control loop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import msgspec

from bioscara.api.messages import StateSample
from bioscara.api.values import QUALITIES
from bioscara.control.loop.loop import CycleReport
from bioscara.drivers import Quality
from bioscara.hardware import LifecycleState
from bioscara.hardware.axis import Axis
from bioscara.kinematics.pose import wrapped
from bioscara.robot.runner import Runner

_NUMBER = {quality: number for number, quality in enumerate(QUALITIES)}
_UNKNOWN = len(QUALITIES) - 1
_FRESH = Quality.FRESH


class Sampler:
    """Makes a sample of the arm's state at the end of each cycle."""

    def __init__(self, runner: Runner) -> None:
        self._runner, self._arm = runner, runner.arm
        self._names = tuple(axis.name for axis in runner.arm.stack.hardware.axes)
        self._cycle = 0

    def sample(self, cycle: CycleReport) -> StateSample:
        """Return the state at the end of a cycle."""
        arm = self._arm
        stack = arm.stack
        self._cycle += 1
        axes, states = stack.hardware.axes, stack.broadcaster.states
        count = len(axes)
        pose = None
        if states is None:
            positions = velocities = (math.nan,) * count
            qualities, stamps = (_UNKNOWN,) * count, (math.nan,) * count
        else:
            positions, velocities, stamps = states.positions, states.velocities, states.stamps
            qualities = tuple([_NUMBER[quality] for quality in states.qualities])
            if not math.isnan(sum(positions)):
                pose = arm.workspace.kinematics.forward(positions)
                pose = pose._replace(yaw=wrapped(pose.yaw))
        return StateSample(
            cycle=self._cycle,
            time=cycle.time,
            names=self._names,
            positions=positions,
            velocities=velocities,
            qualities=qualities,
            stamps=stamps,
            flags=tuple([int(axis.sample.flags) for axis in axes]),
            commands=tuple([axis.position_command.value for axis in axes]),
            pose=pose,
            **self._condition(),
            late=max(cycle.timing.late, 0.0),
            bus_time=stack.hardware.bus_time,
            stale=states is None,
            loads=_loads(axes),
        )

    def now(self, sample: StateSample) -> StateSample:
        """Return a sample with the condition of the arm as it is now, between two cycles.

        A client that has just set the speed reads its own value.
        """
        arm = self._arm
        if not arm.session.connected:
            return msgspec.structs.replace(sample, enabled=False, moving=())
        return msgspec.structs.replace(sample, **self._condition())

    def _condition(self) -> dict[str, Any]:
        arm, stack = self._arm, self._arm.stack
        return {
            "width": arm.jaws.commanded,
            "enabled": stack.hardware.state is LifecycleState.ACTIVE,
            "fault": stack.supervisor.state,
            "paused": bool(pauses := arm.pauses),
            "paused_by": tuple(pauses.values()),
            "speed_override": arm.speed_override,
            "limitation": self._runner.limitation,
            "moving": tuple([each.name for each in arm.operations if each.devices]),
        }


def _loads(axes: Sequence[Axis]) -> tuple[float, ...] | None:
    """Return the loads that the joints report [%]; None if none does.

    That of a joint that did not answer says nothing about now.
    """
    loads = [
        None if axis.sample.quality is not _FRESH else axis.sample.load_percent for axis in axes
    ]
    if loads.count(None) == len(loads):
        return None
    return tuple([math.nan if load is None else load for load in loads])
