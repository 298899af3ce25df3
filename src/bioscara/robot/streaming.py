"""The motion loop: one setpoint per joint and period, one bus call, one record."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bioscara.clock import Clock
from bioscara.drivers import Joint, Quality, Setpoint, track
from bioscara.errors import BioscaraError, MotionCancelledError
from bioscara.report import CycleRecord, JointRecord
from bioscara.report import Quality as RecordQuality
from bioscara.robot.records import Cancelled, Recorder, joint_record
from bioscara.robot.timeline import Reference, Timeline


class Streamer:
    """Feeds setpoints to the joints at a fixed rate.

    A joint reaches a setpoint one period after it arrives, so each joint is sent its reference of
    one period after the time at which its frame will arrive.

    Args:
        joints: The joints, in the order of the references.
        clock: The arm's time.
        period: Time from cycle to cycle [s].
        recorder: Takes the records.

    Attributes:
        last: Reference that was sent last: the arm is heading for it.
        last_time: Time in the trajectory that ``last`` belongs to [s].
    """

    def __init__(
        self, joints: Sequence[Joint], clock: Clock, period: float, recorder: Recorder
    ) -> None:
        self._joints, self._clock = tuple(joints), clock
        self._period, self._recorder = period, recorder
        self._arrival = [0.0] * len(self._joints)
        self._lost: dict[str, JointRecord] = {}
        self.last: Reference | None = None
        self.last_time = 0.0

    def run(self, timeline: Timeline, cancelled: Cancelled) -> None:
        """Follow ``timeline`` from its begin to its end.

        Raises:
            MotionCancelledError: It was asked to end; the joints are still moving.
            BioscaraError: As :func:`bioscara.drivers.track`; joints may still be moving.
        """
        start = deadline = self._clock.now()
        while (now := self._clock.now()) - start < timeline.duration:
            if cancelled():
                into = now - start - timeline.zero
                where = "into" if into >= 0.0 else "before the start of"
                raise MotionCancelledError(f"interrupted {abs(into):.2f} s {where} the trajectory")
            self._recorder.hand_on(self._cycle(timeline, start, now, now - deadline))
            # Deadlines that have passed are dropped: setpoints never come in a burst.
            missed = int((self._clock.now() - deadline) / self._period)
            deadline += (missed + 1) * self._period
            self._clock.sleep_until(deadline)

    def leave_out(self, error: BioscaraError) -> bool:
        """Go on without the joint that ``error`` is about.

        Returns:
            Whether it is about one joint that was not left out before, and others remain.
        """
        for joint in self._joints:
            named = joint.name == getattr(error, "joint", "")
            if joint.name not in self._lost and (
                named or joint.parameters.address == getattr(error, "address", None)
            ):
                nan = math.nan
                self._lost[joint.name] = JointRecord(
                    self._clock.now() - self._recorder.origin,
                    nan,
                    nan,
                    nan,
                    nan,
                    0,
                    RecordQuality.STALE,
                )
                return len(self._lost) < len(self._joints)
        return False

    def _cycle(self, timeline: Timeline, start: float, now: float, late: float) -> CycleRecord:
        """Send and measure once; times are on the arm's clock."""
        time, retries = now - start, self._recorder.retries()
        ahead = [timeline.sample(time + self._period + arrival) for arrival in self._arrival]
        self.last = Reference(
            tuple(reference.positions[index] for index, reference in enumerate(ahead)),
            tuple(reference.velocities[index] for index, reference in enumerate(ahead)),
        )
        self.last_time = time + self._period - timeline.zero
        return CycleRecord(
            phase=timeline.phase(time),
            start=now - self._recorder.origin,
            trajectory_time=time - timeline.zero,
            joints=self._exchange(timeline, start, now, self.last),
            bus_time=self._clock.now() - now,
            retries=self._recorder.retries() - retries,
            late=max(late, 0.0),
        )

    def _exchange(
        self, timeline: Timeline, start: float, now: float, ahead: Reference
    ) -> tuple[JointRecord, ...]:
        """Send each joint its setpoint and return what it measured, beside what was asked."""
        chosen = [i for i, joint in enumerate(self._joints) if joint.name not in self._lost]
        samples = track(
            [self._joints[index] for index in chosen],
            [Setpoint(ahead.positions[index], ahead.velocities[index]) for index in chosen],
            retry=True,
        )
        # One bus call carries all frames, one after the other and all of the same length.
        share = (self._clock.now() - now) / len(chosen)
        records = [self._lost.get(joint.name) for joint in self._joints]
        for place, (index, sample) in enumerate(zip(chosen, samples, strict=True)):
            if isinstance(sample, BioscaraError):
                raise sample
            self._arrival[index] = share * (place + 1)
            fresh = sample.quality is Quality.FRESH
            measured = now + self._arrival[index] if fresh else sample.stamp
            then = timeline.sample(measured - start)
            reference = (then.positions[index], then.velocities[index])
            records[index] = joint_record(sample, measured - self._recorder.origin, reference)
        return tuple(record for record in records if record is not None)
