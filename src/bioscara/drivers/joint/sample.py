"""What a joint says in one cycle, and what it is told."""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple

from bioscara.protocol import Flags, JointState


class Quality(Enum):
    """How far a sample can be believed."""

    FRESH = "fresh"
    """The joint said so in this cycle."""
    STALE = "stale"
    """The exchange failed; this is what the joint said before."""
    ASSUMED = "assumed"
    """Nobody measured it: this is what the device was told."""
    UNKNOWN = "unknown"
    """The joint has not said anything yet."""


class JointSample(NamedTuple):
    """State of one joint.

    Attributes:
        position: Joint position [rad or m]; None while the joint is not homed.
        velocity: Joint velocity [rad/s or m/s]; NaN while the quality is UNKNOWN. A version 1
            joint tells none in a tracking cycle: there it is the difference of two positions.
        flags: The joint's flags.
        state: What the joint is doing; None where it did not say (TRACK, version 1).
        load_percent: Position error as a share of the stall threshold; None likewise.
        quality: How far the sample can be believed.
        stamp: When the answer arrived [s], on the clock of the joint.
    """

    position: float | None
    velocity: float
    flags: Flags
    state: JointState | None
    load_percent: float | None
    quality: Quality
    stamp: float


class Setpoint(NamedTuple):
    """What one joint is to do.

    Attributes:
        position: Joint position one interval from now [rad or m].
        velocity: Joint velocity there [rad/s or m/s]; a version 1 joint ignores it.
    """

    position: float
    velocity: float = 0.0


FLAGS = tuple(Flags(value) for value in range(256))
"""Every flags byte, made once: making an IntFlag costs more than an exchange's arithmetic."""

UNKNOWN = JointSample(
    None,
    math.nan,
    FLAGS[Flags.NOTHOMED | Flags.NOTENABLED],
    None,
    None,
    Quality.UNKNOWN,
    -math.inf,
)
"""The sample of a joint that has not said anything yet."""
