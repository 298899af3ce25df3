"""Suggestions for unknown names."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_LONGEST = 100
"""Characters of a name that are compared: no known name is longer, and comparing is slow."""


def did_you_mean(name: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return the hint for the message about an unknown name.

    Args:
        name: The unknown name.
        known: The known names.
        otherwise: The hint if none of them is similar.
    """
    near = difflib.get_close_matches(str(name)[:_LONGEST], list(known), 1)
    return f"did you mean {near[0]}?" if near else otherwise
