"""Poses of a four-axis arm: a place and a turn about the vertical."""

from __future__ import annotations

import math
from typing import NamedTuple, Self


class Pose(NamedTuple):
    """A frame that stands upright in another: it can be turned about the vertical only.

    Attributes:
        x: [m].
        y: [m].
        z: [m].
        yaw: Turn about z [rad].
    """

    x: float
    y: float
    z: float
    yaw: float = 0.0

    def __str__(self) -> str:
        return f"({self.x:.4g}, {self.y:.4g}, {self.z:.4g}) m, yaw {self.yaw:.4g} rad"

    def compose(self, other: Pose) -> Pose:
        """Return ``other``, given in this frame, in the frame that this one is given in."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            self.z + other.z,
            self.yaw + other.yaw,
        )

    def inverse(self) -> Self:
        """Return the frame that this one is given in, as it is seen from this one."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self._replace(
            x=-c * self.x - s * self.y, y=s * self.x - c * self.y, z=-self.z, yaw=-self.yaw
        )


TURN = 2.0 * math.pi
"""One full turn [rad]."""

IDENTITY = Pose(0.0, 0.0, 0.0, 0.0)
"""The frame itself."""


def wrapped(angle: float) -> float:
    """Return ``angle`` [rad] as the equal one above -pi and up to pi."""
    turned = math.remainder(angle, TURN)
    return math.pi if turned == -math.pi else turned
