"""What the values of a zone may be."""

from __future__ import annotations

import math

from bioscara.errors import ConfigurationError
from bioscara.planning.layout import LINKS

FAR = 10.0
"""Coordinates of a scene are below this [m]: larger ones are millimetres."""


def make_tuples(owner: object, *sequences: str) -> None:
    """Make tuples of what may have come as lists: layouts are kept by value.

    Args:
        owner: A frozen dataclass that is being made.
        sequences: Names of its attributes.
    """
    for name in sequences:
        object.__setattr__(owner, name, tuple(getattr(owner, name)))


def check_name(name: str, links: tuple[str, ...]) -> None:
    """Make sure that a zone may be called so and is for links that there are.

    Raises:
        ConfigurationError: It may not, or is not.
    """
    if not name.strip():
        raise ConfigurationError(f"zone {name!r}: it needs a name")
    if name in (*LINKS, "base_link", "table"):
        raise ConfigurationError(f"zone {name}: the name is taken by the table or a link")
    for link in links:
        if link not in LINKS:
            raise ConfigurationError(
                f"zone {name}: {link!r} is not a link that moves; those are {', '.join(LINKS)}"
            )


def check_range(name: str, axis: str, low: float, high: float) -> None:
    """Make sure that a range of coordinates [m] is one.

    Raises:
        ConfigurationError: A coordinate is too far, or the first is not the smaller.
    """
    for value in (low, high):
        check_number(f"zone {name}: {axis}", value, -FAR, FAR)
    if not low < high:
        raise ConfigurationError(
            f"zone {name}: {axis} goes from {low:g} m to {high:g} m; the first must be the smaller"
        )


def check_number(what: str, value: float, lower: float, upper: float, unit: str = "m") -> None:
    """Make sure that a value is a number between two others.

    Raises:
        ConfigurationError: It is not; names ``what`` and the bounds.
    """
    if not lower <= value <= upper:
        hint = "; are these millimetres? lengths are metres" if unit == "m" else ""
        if not math.isfinite(value) or abs(value) <= FAR:
            hint = ""
        raise ConfigurationError(
            f"{what}: {value:g} {unit} is outside {lower:g} .. {upper:g} {unit}{hint}"
        )
