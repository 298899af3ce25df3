"""The facts of a run that its samples do not contain."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import Enum


class Outcome(Enum):
    """How a run ended."""

    COMPLETED = "completed"
    CANCELLED = "cancelled"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class JointInfo:
    """Identity of a joint.

    Attributes:
        name: Name of the joint.
        address: Its 7-bit bus address.
        unit: Unit of its position, ``rad`` or ``m``.
        firmware: Protocol and firmware version in words.
    """

    name: str
    address: int
    unit: str
    firmware: str


@dataclass(frozen=True, slots=True)
class RunSummary:
    """The facts of a run.

    Attributes:
        title: Name of the run.
        arm: Which arm on which bus, in words; says whether it is a simulation.
        source: Origin of the trajectory.
        version: Version of the package.
        started: Begin of the run, with time zone.
        outcome: How it ended.
        message: Why it did not complete; empty if it did.
        joints: The joints of the arm.
        planned_duration: Duration of the trajectory [s]; NaN where it did not end.
        notes: Notes for the user, one sentence each.
        faults: Faults and errors, one sentence each.
        measured: Measurements in the simulated world, one sentence each.
    """

    title: str
    arm: str
    source: str
    version: str
    started: datetime
    outcome: Outcome
    message: str
    joints: tuple[JointInfo, ...]
    planned_duration: float
    notes: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()
    measured: tuple[str, ...] = ()
