"""Records of the control cycles, in the form that the report stores."""

from __future__ import annotations

import math

from bioscara.control.loop.loop import CycleReport
from bioscara.drivers import Quality
from bioscara.hardware.axis import Axis
from bioscara.report import CycleRecord, JointRecord, Phase, SampleQuality
from bioscara.robot.connection.stack import Stack

_QUALITY = {
    Quality.FRESH: SampleQuality.GOOD,
    Quality.STALE: SampleQuality.STALE,
    Quality.UNKNOWN: SampleQuality.UNKNOWN,
}


class CycleRecorder:
    """Converts cycles to records whose times count from the start of the run.

    Args:
        stack: Control stack that runs the cycles.
        origin: Time on the arm's clock that counts as 0 in the records [s].
    """

    def __init__(self, stack: Stack, origin: float) -> None:
        self._stack, self._origin = stack, origin
        self._retries = self._count()

    def record(self, cycle: CycleReport, phase: Phase, zero: float) -> CycleRecord:
        """Return the record of a cycle.

        Args:
            cycle: The cycle.
            phase: Part of the run.
            zero: Time at which the trajectory began or will begin [s]; NaN if there is none.
        """
        stack, retries = self._stack, self._count()
        feedback = stack.trajectory.feedback
        following = feedback is not None and feedback.time == cycle.time
        joints = []
        for index, axis in enumerate(stack.hardware.axes):
            reference = velocity = math.nan
            if math.isnan(zero) or axis.halted is not None:
                pass
            elif following and feedback is not None:
                reference = feedback.actual.positions[index] + feedback.error.positions[index]
                velocity = feedback.actual.velocities[index] + feedback.error.velocities[index]
            else:
                guard = stack.manager.limiter.joints[axis.name]
                velocity = guard.speed
                ahead = cycle.time + stack.loop.period - axis.position.stamp
                reference = guard.reference - velocity * ahead
            joints.append(self._joint(axis, reference, velocity))
        repeated, self._retries = retries - self._retries, retries
        return CycleRecord(
            phase=phase,
            start=cycle.time - self._origin,
            trajectory_time=cycle.time - zero,
            bus_time=stack.hardware.bus_time,
            retries=repeated,
            late=max(cycle.timing.late, 0.0),
            joints=tuple(joints),
        )

    def _joint(self, axis: Axis, reference: float, velocity: float) -> JointRecord:
        sample = axis.sample
        quality = _QUALITY[axis.position.quality]
        return JointRecord(
            time=max(axis.position.stamp - self._origin, 0.0),
            reference=reference,
            reference_velocity=velocity,
            position=axis.position.value,
            velocity=axis.velocity.value,
            flags=int(sample.flags),
            quality=quality,
            load=math.nan if sample.load_percent is None else sample.load_percent,
        )

    def _count(self) -> int:
        return sum(joint.session.retries for joint in self._stack.hardware.joints)
