"""Sample and setpoint of a joint in one cycle."""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple

from bioscara.protocol import Flags, JointState


class Quality(Enum):
    """Trustworthiness of a sample."""

    FRESH = "fresh"
    """The joint reported it in this cycle."""
    STALE = "stale"
    """The exchange failed; these are the last values that the joint reported."""
    ASSUMED = "assumed"
    """Not measured: these are the values commanded to the device."""
    UNKNOWN = "unknown"
    """The joint has not reported anything yet."""


class JointSample(NamedTuple):
    """State of one joint.

    Attributes:
        position: Joint position [rad or m]; None while the joint is not homed.
        velocity: Joint velocity [rad/s or m/s]; NaN while the quality is UNKNOWN. A version 1 joint
            reports none in a tracking cycle: there it is computed from two positions.
        flags: The joint's flags.
        state: State of the joint; None where it was not reported (in a tracking cycle, version 1).
        load_percent: Position error as a share of the stall threshold, 0 to 255, 0 for a joint
            without power; None where it is not reported: by version 1, and in tracking cycles by
            firmware without the capability LOAD and on a bus without time for it. In a tracking
            cycle it may be that of one of the cycles before, see
            :meth:`~bioscara.drivers.joint.cyclic.CyclicExchange.ask_load`.
        quality: Trustworthiness of the sample.
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
    """Setpoint of one joint.

    Attributes:
        position: Joint position one interval from now [rad or m].
        velocity: Joint velocity at that position [rad/s or m/s]; a version 1 joint ignores it.
    """

    position: float
    velocity: float = 0.0


FLAGS = tuple(Flags(value) for value in range(256))
"""All flags bytes, created once: creating an IntFlag takes longer than an exchange's arithmetic."""

UNKNOWN = JointSample(
    None,
    math.nan,
    FLAGS[Flags.NOTHOMED | Flags.NOTENABLED],
    None,
    None,
    Quality.UNKNOWN,
    -math.inf,
)
"""Sample of a joint that has not reported anything yet."""
