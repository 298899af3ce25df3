"""What the values of a zone may be."""

from __future__ import annotations

from bioscara.arguments import items, number, shown
from bioscara.errors import ConfigurationError
from bioscara.planning.collision.scene_pairs import LINKS

LONGEST = 100
"""Characters that the name of a zone may have."""
FAR = 10.0
"""Coordinates of a scene are below this [m]: larger ones are millimetres."""


def make_tuples(owner: object, *sequences: str) -> None:
    """Make tuples of what may have come as lists: layouts are kept by value.

    Args:
        owner: A frozen dataclass that is being made.
        sequences: Names of its attributes.
    """
    for name in sequences:
        what = f"the {name} of a zone or scene"
        values = items(what, getattr(owner, name), error=ConfigurationError)
        object.__setattr__(owner, name, values)


def replace_values(owner: object, **values: object) -> None:
    """Put checked values into a frozen dataclass that is being made."""
    for name, value in values.items():
        object.__setattr__(owner, name, value)


def check_name(name: str, links: tuple[str, ...]) -> None:
    """Make sure that a zone may be called so and is for links that there are.

    Raises:
        ConfigurationError: It may not, or is not.
    """
    if not isinstance(name, str) or not name.strip():
        raise ConfigurationError(f"zone {shown(name)}: it needs a name")
    if len(name) > LONGEST or not name.isprintable():
        raise ConfigurationError(
            f"zone {shown(name)}: a name is one printable line of at most {LONGEST} characters"
        )
    if name in (*LINKS, "base_link", "table"):
        raise ConfigurationError(f"zone {name}: the name is taken by the table or a link")
    for link in links:
        if not isinstance(link, str) or link not in LINKS:
            raise ConfigurationError(
                f"zone {name}: {shown(link)} is not a link that moves; those are {', '.join(LINKS)}"
            )


def check_range(name: str, axis: str, low: float, high: float) -> tuple[float, float]:
    """Return a range of coordinates [m].

    Raises:
        ConfigurationError: A coordinate is too far, or the first is not the smaller.
    """
    low, high = (check_number(f"zone {name}: {axis}", value, -FAR, FAR) for value in (low, high))
    if not low < high:
        raise ConfigurationError(
            f"zone {name}: {axis} goes from {low:g} m to {high:g} m; the first must be the smaller"
        )
    return low, high


def check_number(what: str, value: float, lower: float, upper: float, unit: str = "m") -> float:
    """Return a number that is between two others.

    Raises:
        ConfigurationError: It is not; names ``what`` and the bounds.
    """
    value = number(what, value, error=ConfigurationError)
    if not lower <= value <= upper:
        hint = "; are these millimetres? lengths are metres" if unit == "m" else ""
        if abs(value) <= FAR:
            hint = ""
        raise ConfigurationError(
            f"{what}: {value:g} {unit} is outside {lower:g} .. {upper:g} {unit}{hint}"
        )
    return value
