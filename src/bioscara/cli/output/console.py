"""Messages and exit status of a command; a failing output does not affect the arm."""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
from collections.abc import Iterable, Sequence
from enum import IntEnum
from typing import TextIO

from bioscara.printing import brief, printable


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
                print(coloured(printable(text), sys.stdout), flush=True)  # noqa: T201
            except OSError as error:
                self.fail(error)

    def lines(self, texts: Iterable[str]) -> None:
        """Write lines."""
        for text in texts:
            self.line(text)

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
        text = "bioscara: " + brief(" ".join(message.split()))
        print(coloured(text, sys.stderr), file=sys.stderr)  # noqa: T201


def coloured(text: str, stream: TextIO) -> str:
    """Return a line with its first word in colour, where it reports a problem on a terminal."""
    for word, colour in (("bioscara:", "1;31"), ("warning:", "33"), ("note:", "36")):
        if text.startswith(word) and is_terminal(stream) and not os.environ.get("NO_COLOR"):
            return f"\x1b[{colour}m{word}\x1b[0m{text.removeprefix(word)}"
    return text


def is_terminal(stream: TextIO) -> bool:
    """Return whether a stream is a terminal that can do more than print lines."""
    return stream.isatty() and os.environ.get("TERM", "dumb") != "dumb"


def columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows as lines whose cells are aligned in columns.

    A table that is wider than the terminal is continued below, beginning with its first column.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    space = shutil.get_terminal_size().columns if sys.stdout.isatty() else sum(widths) * 3
    parts: list[list[int]] = [[0]]
    for index in range(1, len(widths)):
        wide = sum(widths[each] + 2 for each in parts[-1]) + widths[index]
        if wide > space and len(parts[-1]) > 1:
            parts.append([0])
        parts[-1].append(index)
    lines: list[str] = []
    for part in parts:
        lines += [""] if lines else []
        lines += [
            "  ".join(row[index].ljust(widths[index]) for index in part).rstrip() for row in rows
        ]
    return lines
