"""Messages and exit status of a command; a failing output does not affect the arm."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Sequence
from enum import IntEnum

from bioscara.printing import printable


class ExitStatus(IntEnum):
    """Exit status of every command."""

    OK = 0
    FAILED = 1
    """Something went wrong after the arm began to move, a joint is missing, or a file could
    not be written."""
    REFUSED = 2
    """Wrong usage, or refused with the reason before anything moved."""
    INTERRUPTED = 130
    """Ctrl-C, SIGTERM or SIGHUP; the arm was stopped and disabled."""


class Output:
    """Writes lines to standard output until that fails, and nothing from then on.

    Attributes:
        problem: The error that ended the output; None while it works.
    """

    def __init__(self) -> None:
        self.problem: OSError | None = None

    def line(self, text: str = "") -> None:
        """Write and flush one line; non-printable characters, also line ends, are escaped."""
        if self.problem is None:
            try:
                print(printable(text), flush=True)  # noqa: T201
            except OSError as error:
                self.fail(error)

    def fail(self, error: OSError) -> None:
        """End the output because of ``error``."""
        self.problem = error

    def check(self) -> None:
        """Raise the error of the output; to be called at the end, when it disturbs nothing.

        Raises:
            OSError: The error that ended the output; BrokenPipeError if the reader closed it.
        """
        if self.problem is not None:
            raise self.problem


def complain(message: str) -> None:
    """Write one line to standard error."""
    with contextlib.suppress(OSError):
        print("bioscara: " + printable(" ".join(message.split())), file=sys.stderr)  # noqa: T201


def columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows as lines whose cells are aligned in columns."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
