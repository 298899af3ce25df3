"""Validation of the values of a zone."""

from __future__ import annotations

from bioscara.arguments import items, number, shown
from bioscara.errors import ConfigurationError
from bioscara.planning.collision.scene_pairs import LINKS

LONGEST = 100
"""Largest length of a zone's name [characters]."""
FAR = 10.0
"""Largest coordinate of a scene [m]: a larger one is taken for millimetres."""


def make_tuples(owner: object, *sequences: str) -> None:
    """Convert attributes that may be lists to tuples: layouts are cached by value.

    Args:
        owner: A frozen dataclass that is being constructed.
        sequences: Names of its attributes.
    """
    for name in sequences:
        what = f"the {name} of a zone or scene"
        values = items(what, getattr(owner, name), error=ConfigurationError)
        object.__setattr__(owner, name, values)


def replace_values(owner: object, **values: object) -> None:
    """Set checked values in a frozen dataclass that is being constructed."""
    for name, value in values.items():
        object.__setattr__(owner, name, value)


def check_name(name: str, links: tuple[str, ...]) -> None:
    """Make sure that the name of a zone is valid and that its links exist.

    Raises:
        ConfigurationError: The name is invalid, or a link does not exist.
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
    """Check a range of coordinates [m] and return it.

    Raises:
        ConfigurationError: A coordinate is too large, or the first is not the smaller.
    """
    low, high = (check_number(f"zone {name}: {axis}", value, -FAR, FAR) for value in (low, high))
    if not low < high:
        raise ConfigurationError(
            f"zone {name}: {axis} goes from {low:g} m to {high:g} m; the first must be the smaller"
        )
    return low, high


def check_number(what: str, value: float, lower: float, upper: float, unit: str = "m") -> float:
    """Check that a number is between two bounds and return it.

    Raises:
        ConfigurationError: It is not; the message names ``what`` and the bounds.
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
