"""Lengths and angles in the units that people measure them in, converted to metres and radians."""

from __future__ import annotations

import math

from bioscara.arguments import number


def mm(length: float) -> float:
    """Return a length given in millimetres [m].

    Raises:
        InvalidArgumentError: It is not a finite number.
    """
    return number("mm()", length) / 1e3


def deg(angle: float) -> float:
    """Return an angle given in degrees [rad].

    Raises:
        InvalidArgumentError: It is not a finite number.
    """
    return math.radians(number("deg()", angle))
