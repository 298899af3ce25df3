"""Joint positions and poses as text, with angles in radians or in degrees."""

from __future__ import annotations

import math
from typing import NamedTuple

from bioscara.cli.parser import Options
from bioscara.kinematics import Joints, Pose

LENGTHS = frozenset({"j2", "x", "y", "z"})
"""Values of joints and poses that are no angles."""


class AngleUnit(NamedTuple):
    """Unit in which angles are shown.

    Attributes:
        name: Its symbol.
        per_radian: Number of them in a radian.
        digits: Digits after the point, of a resolution like 0.1 mm at the tool.
    """

    name: str
    per_radian: float
    digits: int

    def quantity(self, value: float, unit: str, per: str = "", *, sign: str = "+") -> str:
        """Return a value with its unit; one in rad is converted.

        Args:
            value: The value [rad or m, or per second].
            unit: ``"rad"`` or ``"m"``.
            per: Suffix of the unit, such as ``"/s"``.
            sign: ``"+"`` for the sign of positive values too.
        """
        if unit != "rad":
            return f"{value:{sign}z.4f} {unit}{per}"
        return f"{value * self.per_radian:{sign}z.{self.digits}f} {self.name}{per}"

    def numbers(self, values: Joints | Pose, *, sign: str = "+") -> str:
        """Return joint positions or a pose as four numbers."""
        return " ".join(
            self.quantity(value, "m" if field in LENGTHS else "rad", sign=sign).split()[0]
            for field, value in values._asdict().items()
        )

    def words(self, values: Joints | Pose) -> str:
        """Return joint positions or a pose as words that every command takes as its target."""
        option = "--pose" if isinstance(values, Pose) else "--joints"
        words = f"{option} {self.numbers(values, sign='')}"
        return f"{words} --deg" if self is DEGREES else words


RADIANS = AngleUnit("rad", 1.0, 4)
DEGREES = AngleUnit("deg", math.degrees(1.0), 2)


def angle_unit(options: Options) -> AngleUnit:
    """Return the unit that ``--deg`` selects."""
    return DEGREES if options.degrees else RADIANS
