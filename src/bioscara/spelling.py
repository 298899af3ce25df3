"""What a name that nobody knows was probably meant to be."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_LONGEST = 100
"""Characters of a name that are compared: nothing has a longer one, and comparing takes long."""


def did_you_mean(name: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return the hint for the complaint about an unknown name.

    Args:
        name: As it was given.
        known: The names that there are.
        otherwise: The hint where none of them is like it.
    """
    near = difflib.get_close_matches(str(name)[:_LONGEST], list(known), 1)
    return f"did you mean {near[0]}?" if near else otherwise
