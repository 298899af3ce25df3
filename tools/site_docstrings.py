"""Docstrings of the reference: roles of Sphinx, such as ``:meth:`open```, become code."""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension, Object

_ROLE = re.compile(r":(?:attr|class|func|meth|mod):`~?\.?([^`]+)`")


class PlainRoles(Extension):
    """Replaces roles, which Markdown does not know."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        """Replace the roles in the docstring of an object."""
        if obj.docstring is not None:
            obj.docstring.value = _ROLE.sub(r"`\1`", obj.docstring.value)
