"""The record of one control cycle, and the history of all cycles of a run."""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence
from enum import Enum, IntEnum
from typing import NamedTuple

UNKNOWN = math.nan
"""Placeholder of an unknown number; written as an empty cell."""


class Phase(Enum):
    """Part of a run that a cycle belongs to."""

    HOMING = "homing"
    APPROACH = "approach"
    """The planned ramp from the arm's position to the start of the trajectory."""
    TRAJECTORY = "trajectory"
    SETTLING = "settling"
    """The last setpoint is held for a short time, so that the arm comes to rest at it."""
    WATCHING = "watching"
    """Nothing is commanded."""
    JOG = "jog"
    """Motion by streamed velocities."""
    CONTROLLERS = "controllers"
    """Motion by controllers that a client has loaded."""
    STOPPING = "stopping"
    """The planned ramp to rest after Ctrl-C or a failure."""


class SampleQuality(IntEnum):
    """Reliability of a joint's measured values."""

    GOOD = 0
    STALE = 1
    """The exchange of this cycle failed; the values are those of an earlier one."""
    UNKNOWN = 2
    """The joint's position is unknown (it is not homed), or it never answered."""


class JointRecord(NamedTuple):
    """One joint in one cycle; radians for a revolute joint, metres for a prismatic one.

    Attributes:
        time: Time of the measurement [s since the run began].
        reference: Reference position at ``time``; NaN if there was none.
        reference_velocity: Reference velocity at ``time`` [rad/s or m/s].
        position: Measured position; NaN if unknown.
        velocity: Measured velocity [rad/s or m/s].
        flags: State bits as in the protocol, see :class:`bioscara.protocol.Flags`.
        quality: Reliability of the measured values.
        load: Load relative to the stall threshold when it was last read [%]; NaN if the joint
            does not report it.
    """

    time: float
    reference: float
    reference_velocity: float
    position: float
    velocity: float
    flags: int
    quality: SampleQuality
    load: float = UNKNOWN


class CycleRecord(NamedTuple):
    """All joints in one cycle.

    Attributes:
        phase: Part of the run.
        start: Begin of the cycle [s since the run began].
        trajectory_time: Time in the trajectory at ``start`` [s]; negative during the
            approach, NaN if there is no trajectory.
        bus_time: Duration of the exchange with all joints [s].
        retries: Number of repeated exchanges in this cycle.
        late: Delay of the begin of the cycle against its schedule [s].
        joints: One record per joint, in the order of the run's joint names.
        progress: Share of the operation that is done, 0 to 1; NaN if that is unknown.
    """

    phase: Phase
    start: float
    trajectory_time: float
    bus_time: float
    retries: int
    late: float
    joints: tuple[JointRecord, ...]
    progress: float = UNKNOWN


class CycleHistory:
    """Every cycle of a run, stored by column: an hour at 100 Hz takes about 80 MB.

    Args:
        joint_names: Names of the joints, in the order of every cycle's records.
    """

    def __init__(self, joint_names: Sequence[str]) -> None:
        self.joint_names = tuple(joint_names)
        self.phases: list[Phase] = []
        self.start = array("d")
        self.trajectory_time = array("d")
        self.bus_time = array("d")
        self.late = array("d")
        self.retries = array("l")
        self.columns = tuple(JointColumns() for _ in joint_names)

    def __len__(self) -> int:
        return len(self.phases)

    def append(self, cycle: CycleRecord) -> None:
        """Store ``cycle``."""
        self.phases.append(cycle.phase)
        self.start.append(cycle.start)
        self.trajectory_time.append(cycle.trajectory_time)
        self.bus_time.append(cycle.bus_time)
        self.late.append(cycle.late)
        self.retries.append(cycle.retries)
        for column, record in zip(self.columns, cycle.joints, strict=True):
            column.append(record)


class JointColumns:
    """The records of one joint, one array per value; same meaning as in :class:`JointRecord`."""

    def __init__(self) -> None:
        self.time = array("d")
        self.reference = array("d")
        self.reference_velocity = array("d")
        self.position = array("d")
        self.velocity = array("d")
        self.flags = array("B")
        self.quality = array("B")
        self.load = array("d")

    def append(self, record: JointRecord) -> None:
        """Store ``record``."""
        self.time.append(record.time)
        self.reference.append(record.reference)
        self.reference_velocity.append(record.reference_velocity)
        self.position.append(record.position)
        self.velocity.append(record.velocity)
        self.flags.append(record.flags)
        self.quality.append(record.quality)
        self.load.append(record.load)
