"""Reasons for which a jog is slower than its command, or stands."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from bioscara.planning.collision.scene_pairs import Pair
from bioscara.planning.limits import JointLimits


class JogLimit(Enum):
    """What limits a jog."""

    JOINT_LIMIT = "joint_limit"
    """A joint is at an end of its range, or has to stop before it."""
    JOINT_SPEED = "joint_speed"
    """A joint is at its highest speed."""
    TOOL_SPEED = "tool_speed"
    """The tool is at its highest speed, or would exceed it before it is at rest."""
    ZONE = "zone"
    """The arm would come too near to a zone before it is at rest."""
    TABLE = "table"
    """Likewise, to the table."""
    SELF = "self"
    """Likewise, to a part of itself."""
    STRETCHED = "stretched"
    """The elbow is straight: x and y of the tool stand, z and yaw do not."""
    FOLDED = "folded"
    """The elbow is folded; as if it was straight."""
    EXPIRED = "expired"
    """No velocity came in time."""
    CHANGE = "change"
    """The arm first rests, as velocities of the tool follow those of joints, or the reverse."""


@dataclass(frozen=True, slots=True)
class JogLimitation:
    """Why a jog does not follow its velocity.

    Attributes:
        limit: What limits it.
        held: Whether what it limits stands; else it is slower than commanded.
        name: Name of the joint, or of the zone or link that is too near; else empty.
        value: The limit of the joint or of the tool [rad, m, rad/s or m/s]; NaN if there is none.
        unit: Unit of the value; else empty.
        text: The same as a sentence for people, such as ``"held: j2 at its upper limit 0.338 m"``.
    """

    limit: JogLimit
    held: bool
    name: str
    value: float
    unit: str
    text: str

    def __str__(self) -> str:
        return self.text


class LimitCause(NamedTuple):
    """What limits a jog, in the terms of its computation.

    Attributes:
        limit: What limits it.
        joint: The joint, for its limits.
        upper: Whether it is at its upper limit.
        pair: The bodies that are too near to each other.
        speed: Highest speed of the tool [m/s].
        level: Whether only x and y of the tool are limited.
    """

    limit: JogLimit
    joint: JointLimits | None = None
    upper: bool = False
    pair: Pair | None = None
    speed: float = math.nan
    level: bool = False

    @classmethod
    def of_pair(cls, pair: Pair) -> LimitCause:
        """Return the cause for two bodies that are too near to each other."""
        if pair.own:
            return cls(JogLimit.SELF, pair=pair)
        return cls(JogLimit.TABLE if pair.zone == "table" else JogLimit.ZONE, pair=pair)

    def limitation(self, held: bool, moving: bool) -> JogLimitation:
        """Return the limitation, for people too.

        Args:
            held: Whether what it limits stands.
            moving: Whether x or y of the tool are commanded.
        """
        what = "held" if held else "slowed"
        name, value, unit, words = "", math.nan, "", _WORDS.get(self.limit, "")
        match self.limit:
            case JogLimit.STRETCHED | JogLimit.FOLDED:
                bent, away = words.split(";")
                if not moving:
                    text = f"the elbow is {bent}: yaw turns the hand about the axis of the wrist"
                elif held:
                    text = f"x, y held: the elbow is {bent};{away}"
                else:
                    text = f"x, y slowed: the elbow is nearly {bent}"
                return JogLimitation(self.limit, held, name, value, unit, text)
            case JogLimit.TOOL_SPEED:
                value, unit = self.speed, "m/s"
                words = f"the tool at {value:.3g} m/s, the limit at reduced speed or with the load"
            case JogLimit.JOINT_LIMIT | JogLimit.JOINT_SPEED if self.joint is not None:
                name, value, unit, words = self._of_joint(self.joint, held)
            case JogLimit.ZONE | JogLimit.TABLE | JogLimit.SELF if self.pair is not None:
                name = self.pair.zone
                near = "at the margin of" if held else "near"
                words = f"{self.pair.link} {near} {name}"
        axes = "x, y " if self.level else ""
        return JogLimitation(self.limit, held, name, value, unit, f"{axes}{what}: {words}")

    def _of_joint(self, joint: JointLimits, held: bool) -> tuple[str, float, str, str]:
        if self.limit is JogLimit.JOINT_SPEED:
            value, unit = joint.max_velocity, f"{joint.unit}/s"
            words = f"{joint.name} at its highest speed {value:g} {unit}"
        else:
            value, unit = joint.upper if self.upper else joint.lower, joint.unit
            where = "at" if held else "near"
            end = "upper" if self.upper else "lower"
            words = f"{joint.name} {where} its {end} limit {value:g} {unit}"
        return joint.name, value, unit, words


_WORDS = {
    JogLimit.STRETCHED: "straight; move inwards",
    JogLimit.FOLDED: "folded; move outwards",
    JogLimit.EXPIRED: "no velocity came in time",
    JogLimit.CHANGE: "the arm comes to rest between velocities of joints and of the tool",
}
