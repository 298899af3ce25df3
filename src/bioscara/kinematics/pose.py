"""Poses of a four-axis arm: a place and a turn about the vertical."""

from __future__ import annotations

import math
from typing import NamedTuple

from bioscara.arguments import number, shown
from bioscara.errors import InvalidArgumentError


class Pose(NamedTuple):
    """A frame that stands upright in another: it can be turned about the vertical only.

    Which other one is not part of it. All that plans, moves and tells poses of an arm means its
    tool in its base, also in files and on the command line; what stands in another frame is turned
    into that by :meth:`compose`, ``bench_in_base.compose(plate_in_bench)``.

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
        """Return ``other``, given in this frame, in the frame that this one is given in.

        Raises:
            InvalidArgumentError: One of them is no pose of finite numbers.
        """
        x, y, z, yaw = require_pose("the pose", self)
        there = require_pose("the pose in it", other)
        c, s = math.cos(yaw), math.sin(yaw)
        return Pose(
            x + c * there.x - s * there.y,
            y + s * there.x + c * there.y,
            z + there.z,
            yaw + there.yaw,
        )

    def inverse(self) -> Pose:
        """Return the frame that this one is given in, as it is seen from this one.

        Raises:
            InvalidArgumentError: It is no pose of finite numbers.
        """
        x, y, z, yaw = require_pose("the pose", self)
        c, s = math.cos(yaw), math.sin(yaw)
        return Pose(-c * x - s * y, s * x - c * y, -z, -yaw)


TURN = 2.0 * math.pi
"""One full turn [rad]."""

PLACE_MAX = 10.0
"""Farthest place that is taken for one [m]: beyond it stand millimetres."""

ANGLE_MAX = 4.0 * math.pi
"""Largest angle that is taken for one [rad]: beyond it stand degrees."""

_HINTS = {
    "m": (PLACE_MAX, "are these millimetres? lengths are metres"),
    "rad": (ANGLE_MAX, "are these degrees? angles are radians"),
}

IDENTITY = Pose(0.0, 0.0, 0.0, 0.0)
"""The frame itself."""


def wrapped(angle: float) -> float:
    """Return ``angle`` [rad] as the equal one above -pi and up to pi."""
    turned = math.remainder(angle, TURN)
    return math.pi if turned == -math.pi else turned


def unit_hint(value: float, unit: str) -> str:
    """Return the question that a value raises which is too large for its unit, or nothing.

    Args:
        value: What was given.
        unit: ``"m"`` or ``"rad"``.
    """
    most, hint = _HINTS[unit]
    return hint if math.isfinite(value) and abs(value) > most else ""


def require_pose(what: str, pose: object) -> Pose:
    """Return ``pose`` as a :class:`Pose` of finite floats.

    Args:
        what: Is said to be wrong.
        pose: What was given.

    Raises:
        InvalidArgumentError: It is something else, for example a bare tuple, or not finite.
    """
    if not isinstance(pose, Pose):
        raise InvalidArgumentError(
            f"{what} is {shown(pose)}; give Pose(x, y, z, yaw), in metres and radians"
        )
    x, y, z, yaw = pose
    plain = type(x) is type(y) is type(z) is type(yaw) is float
    if plain and math.isfinite(x + y + z + yaw):
        return pose
    return Pose(*(number(f"{n} of {what}", v) for n, v in zip(Pose._fields, pose, strict=True)))


def require_near(what: str, pose: object) -> Pose:
    """Return ``pose`` as :func:`require_pose` does, unless another unit explains it better.

    Args:
        what: Is said to be wrong.
        pose: What was given.

    Raises:
        InvalidArgumentError: As :func:`require_pose`, or a value is one of millimetres or degrees.
    """
    plain = require_pose(what, pose)
    for name, value, unit in zip(Pose._fields, plain, ("m", "m", "m", "rad"), strict=True):
        hint = unit_hint(value, unit)
        if hint:
            raise InvalidArgumentError(f"{name} of {what} is {value:g} {unit}; {hint}")
    return plain
