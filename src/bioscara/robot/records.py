"""What the drivers measured, as the report keeps it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from bioscara.clock import Clock
from bioscara.drivers import Joint, JointSample
from bioscara.drivers import Quality as SampleQuality
from bioscara.report import CycleRecord, JointRecord, Phase, Quality

Observe = Callable[[CycleRecord], None]
"""Takes each cycle as it ends; must return at once."""
Cancelled = Callable[[], bool]
"""Tells whether the motion shall end; asked once per cycle."""

_QUALITY = {
    SampleQuality.FRESH: Quality.GOOD,
    SampleQuality.STALE: Quality.STALE,
    SampleQuality.UNKNOWN: Quality.UNKNOWN,
}
_NOTHING_ASKED = (math.nan, math.nan)


class Recorder:
    """Turns samples into records whose times count from the begin of the run.

    Args:
        joints: The joints, in the order of the records.
        clock: The arm's time.
        observe: Takes the records.
        origin: Time on the clock that counts as 0 in the records [s].

    Attributes:
        origin: As above.
    """

    def __init__(
        self, joints: Sequence[Joint], clock: Clock, observe: Observe, origin: float
    ) -> None:
        self._joints, self._clock, self._observe = tuple(joints), clock, observe
        self.origin = origin

    def record_last(self) -> None:
        """Hand on what each joint said last, while one of them is homing; asks nobody."""
        now = self._clock.now() - self.origin
        self.hand_on(
            CycleRecord(
                phase=Phase.HOMING,
                start=now,
                trajectory_time=math.nan,
                bus_time=math.nan,
                retries=0,
                late=0.0,
                joints=tuple(
                    joint_record(joint.last, max(joint.last.stamp - self.origin, 0.0))
                    for joint in self._joints
                ),
            )
        )

    def retries(self) -> int:
        """Return how many exchanges were repeated since the joints were made."""
        return sum(joint.session.retries for joint in self._joints)

    def hand_on(self, record: CycleRecord) -> None:
        """Hand a record on."""
        self._observe(record)


def joint_record(
    sample: JointSample, time: float, reference: tuple[float, float] = _NOTHING_ASKED
) -> JointRecord:
    """Return the record of one joint.

    Args:
        sample: What was measured.
        time: When [s since the run began].
        reference: Position and velocity that the joint should have had at that time.
    """
    quality = _QUALITY[sample.quality]
    if sample.position is None and quality is Quality.GOOD:
        quality = Quality.UNKNOWN
    return JointRecord(
        time=time,
        reference=reference[0],
        reference_velocity=reference[1],
        position=math.nan if sample.position is None else sample.position,
        velocity=sample.velocity,
        flags=int(sample.flags),
        quality=quality,
        load=math.nan if sample.load_percent is None else sample.load_percent,
    )
