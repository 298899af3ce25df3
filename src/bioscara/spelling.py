"""Suggestions for unknown names."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_LONGEST = 100
"""Characters of a name that are compared: no known name is longer, and comparing is slow."""


def unknown_attribute(of: object, name: str) -> AttributeError:
    """Return the error for setting an attribute that an object does not have.

    Args:
        of: The object, a robot.
        name: The name; properties that can be set are proposed, and no methods.
    """
    kind = type(of)
    known = [key for key in dir(kind) if getattr(getattr(kind, key), "fset", None) is not None]
    hint = did_you_mean(name, known, f"it has {', '.join(known)}")
    return AttributeError(f"a robot has no attribute {name!r} that can be set; {hint}")


def did_you_mean(name: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return the hint for the message about an unknown name.

    Args:
        name: The unknown name.
        known: The known names.
        otherwise: The hint if none of them is similar.
    """
    near = difflib.get_close_matches(str(name)[:_LONGEST], list(known), 1)
    return f"did you mean {near[0]}?" if near else otherwise
