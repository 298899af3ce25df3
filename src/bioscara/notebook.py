"""What a notebook shows of values and of errors."""

from __future__ import annotations

import html
import sysconfig
import traceback
from collections.abc import Sequence
from pathlib import Path

_OWN, _LIBRARY = Path(__file__).parent, Path(sysconfig.get_path("stdlib"))
"""Folders of files whose frames tell a user nothing."""
_INSTALLED = {"site-packages", "dist-packages"}
"""Names of folders within Python's own where others' packages are."""


def table(rows: Sequence[Sequence[str]], heading: Sequence[str] = ()) -> str:
    """Return a table as HTML.

    Args:
        rows: The texts of its cells; the first of a row is its name.
        heading: The texts above the columns; none by default.
    """
    head = "".join(f"<th>{html.escape(text)}</th>" for text in heading)
    lines = [f"<tr>{head}</tr>"] if heading else []
    for name, *cells in rows:
        data = "".join(f"<td>{html.escape(text)}</td>" for text in cells)
        lines.append(f"<tr><th>{html.escape(name)}</th>{data}</tr>")
    return f"<table>{''.join(lines)}</table>"


def outer_traceback(error: BaseException) -> list[str]:
    """Return the lines of a traceback with the frames of the user's own code.

    An exception behind it is shown if it was raised in the user's code, too.
    """
    told = traceback.TracebackException.from_exception(error)
    link: traceback.TracebackException | None = told
    while link is not None:
        link.stack = _outer(link.stack)
        behind = link.__cause__ or (None if link.__suppress_context__ else link.__context__)
        if behind is not None and not _outer(behind.stack):
            link.__cause__ = link.__context__ = behind = None
        link = behind
    return "".join(told.format()).splitlines()


def _outer(stack: traceback.StackSummary) -> traceback.StackSummary:
    """Return a stack without the frames of the package, of Python's library and of IPython."""
    return traceback.StackSummary.from_list(
        [frame for frame in stack if not _is_inner(frame.filename)]
    )


def _is_inner(name: str) -> bool:
    file = Path(name)
    library = file.is_relative_to(_LIBRARY) and _INSTALLED.isdisjoint(file.parts)
    inside = library or file.is_relative_to(_OWN) or "IPython" in file.parts
    return inside or name.startswith("<frozen")
