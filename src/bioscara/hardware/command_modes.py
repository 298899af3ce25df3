"""Sets of command interfaces that may be claimed together on a joint, and the resulting mode."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum

from bioscara.errors import ModeSwitchError
from bioscara.hardware import interfaces


class Mode(Enum):
    """Command mode of a joint; the value is the set of claimed command interfaces."""

    NONE = frozenset[str]()
    POSITION = frozenset({interfaces.POSITION})
    VELOCITY = frozenset({interfaces.VELOCITY})
    TRACK = frozenset({interfaces.POSITION, interfaces.VELOCITY})
    """Position and velocity together, in one exchange."""
    HOME = frozenset({interfaces.HOME})


MOTION = frozenset({Mode.POSITION, Mode.VELOCITY, Mode.TRACK})
"""Modes that need a homed joint."""


def resolve(component: str, joint: str, claimed: Iterable[str]) -> Mode:
    """Return the mode of a set of claimed interface kinds.

    Raises:
        ModeSwitchError: They exclude one another.
    """
    kinds = frozenset(claimed)
    try:
        return Mode(kinds)
    except ValueError:
        raise ModeSwitchError(
            f"{joint}: {' and '.join(sorted(kinds))} cannot be commanded together; claim "
            f"position, velocity, both of these, or home",
            component,
        ) from None
