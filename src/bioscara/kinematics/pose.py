"""Poses of a four-axis arm: a position and a rotation about the vertical."""

from __future__ import annotations

import math
from typing import NamedTuple

from bioscara.arguments import number, shown
from bioscara.errors import InvalidArgumentError
from bioscara.notebook import table


class Pose(NamedTuple):
    """An upright frame in a parent frame: it can be rotated about the vertical only.

    The parent frame is not stored. Planning, motion and reports, files and the command line use
    the pose of the tool in the arm's base; convert poses given in other frames with
    :meth:`compose`, ``bench_in_base.compose(plate_in_bench)``.

    Attributes:
        x: [m].
        y: [m].
        z: [m].
        yaw: Rotation about z [rad].
    """

    x: float
    y: float
    z: float
    yaw: float = 0.0

    def __str__(self) -> str:
        return f"({self.x:.4g}, {self.y:.4g}, {self.z:.4g}) m, yaw {self.yaw:.4g} rad"

    def __repr__(self) -> str:
        # To a micrometre: the rounding errors of kinematics would fill a line.
        named = zip(self._fields, self, strict=True)
        values = ((n, round(v, 6) if isinstance(v, float) else v) for n, v in named)
        return f"Pose({', '.join(f'{name}={value!r}' for name, value in values)})"

    def _repr_html_(self) -> str:
        return table(
            [(n, f"{v:z.4f}", u) for n, v, u in zip(self._fields, self, UNITS, strict=True)]
        )

    def up(self, distance: float) -> Pose:
        """Return the pose higher by a distance [m]; lower by a negative one.

        Raises:
            InvalidArgumentError: The distance is not finite, or looks like millimetres.
        """
        by = require_near("the way up", Pose(0.0, 0.0, distance)).z
        return self._replace(z=self.z + by)

    def __add__(self, other: object) -> Pose:
        # Of tuples a sum is a longer tuple: a caller would get seven numbers without an error.
        if not isinstance(other, tuple | list):
            return NotImplemented
        raise _refused_sum()

    def __radd__(self, other: object) -> Pose:
        return self + other

    def compose(self, other: Pose) -> Pose:
        """Return ``other``, given in this frame, in the parent frame of this one.

        Raises:
            InvalidArgumentError: One of them is not a pose of finite numbers.
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
        """Return the pose of the parent frame in this one.

        Raises:
            InvalidArgumentError: It is not a pose of finite numbers.
        """
        x, y, z, yaw = require_pose("the pose", self)
        c, s = math.cos(yaw), math.sin(yaw)
        return Pose(-c * x - s * y, s * x - c * y, -z, -yaw)


UNITS = ("m", "m", "m", "rad")
"""Units of the values of a pose."""

TURN = 2.0 * math.pi
"""One full turn [rad]."""

PLACE_MAX = 10.0
"""Largest coordinate accepted [m]: a larger one is taken for millimetres."""

ANGLE_MAX = TURN
"""Largest angle accepted [rad]: a larger one is taken for degrees."""

_HINTS = {
    "m": (PLACE_MAX, "are these millimetres? lengths are metres"),
    "rad": (ANGLE_MAX, "are these degrees? angles are radians"),
}

IDENTITY = Pose(0.0, 0.0, 0.0, 0.0)
"""The pose of a frame in itself."""


def wrapped(angle: float) -> float:
    """Return ``angle`` [rad] wrapped to above -pi and up to pi."""
    turned = math.remainder(angle, TURN)
    return math.pi if turned == -math.pi else turned


def _refused_sum() -> InvalidArgumentError:
    return InvalidArgumentError(
        "a pose cannot be added to: pose.up(0.05) is 50 mm above it, pose.compose(Pose(x, y, z)) "
        "is a place in its frame, and robot.move_relative(z=0.05) moves by a displacement"
    )


def unit_hint(value: float, unit: str) -> str:
    """Return a hint at the probable unit if a value is too large for its own, else ``""``.

    Args:
        value: The given value.
        unit: ``"m"`` or ``"rad"``.
    """
    most, hint = _HINTS[unit]
    return hint if math.isfinite(value) and abs(value) > most else ""


def require_pose(what: str, pose: object) -> Pose:
    """Return ``pose`` as a :class:`Pose` of finite floats.

    Args:
        what: Name of the pose in the error message.
        pose: The given value.

    Raises:
        InvalidArgumentError: It is of another type, for example a bare tuple, or not finite.
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
    """Return ``pose`` as :func:`require_pose` does, unless its values are in another unit.

    Args:
        what: Name of the pose in the error message.
        pose: The given value.

    Raises:
        InvalidArgumentError: As :func:`require_pose`, or a value is in millimetres or degrees.
    """
    plain = require_pose(what, pose)
    for name, value, unit in zip(Pose._fields, plain, UNITS, strict=True):
        hint = unit_hint(value, unit)
        if hint:
            raise InvalidArgumentError(f"{name} of {what} is {value:g} {unit}; {hint}")
    return plain


def require_near_place(what: str, pose: object) -> Pose:
    """Return ``pose`` as :func:`require_near` does, but with a yaw of up to two turns.

    For places whose yaw is not used: kinematics return it without wrapping.

    Args:
        what: Name of the pose in the error message.
        pose: The given value.

    Raises:
        InvalidArgumentError: As :func:`require_near`.
    """
    plain = require_pose(what, pose)
    require_near(what, plain._replace(yaw=0.0) if abs(plain.yaw) <= 2.0 * TURN else plain)
    return plain
