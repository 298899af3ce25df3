"""The facts of a run that its samples do not hold."""

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
    """Who a joint is.

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
class Summary:
    """What happened, in facts.

    Attributes:
        title: Name of the run.
        arm: Which arm on which bus, in words; says whether it is a simulation.
        source: Where the trajectory came from.
        version: Version of the package.
        started: Begin of the run, with time zone.
        outcome: How it ended.
        message: Why it did not complete; empty when it did.
        joints: Who took part.
        planned_duration: Length of the trajectory [s].
        notes: What the person should know, one sentence each.
        faults: What went wrong, one sentence each.
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
