"""Keys of a terminal as they are pressed, also through ssh."""

from __future__ import annotations

import os
import re
import select
import sys
import termios
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Self

from bioscara.cli.output.console import Output
from bioscara.errors import InvalidArgumentError

_ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}
_SEQUENCE = re.compile(r"\x1b[\[O]([0-9;]*)([A-Za-z~])")
_PARTIAL = re.compile(r"\x1b([\[O][0-9;]*)?\Z")


class Keyboard:
    """Reads the keys of a terminal without waiting, echo or line editing, while entered.

    Ctrl-C remains a signal. Ctrl-Z does nothing: a process that is suspended would leave its arm
    without setpoints.

    Args:
        terminal: File descriptor of the terminal; standard input by default.

    Attributes:
        closed: Whether the terminal is gone.

    Raises:
        InvalidArgumentError: It is no terminal.
    """

    def __init__(self, terminal: int | None = None) -> None:
        self._terminal = sys.stdin.fileno() if terminal is None else terminal
        if not os.isatty(self._terminal):
            raise InvalidArgumentError(
                "keys are read from a terminal, and standard input is none; run it in a terminal"
            )
        self._rest = ""
        self.closed = False

    def __enter__(self) -> Self:
        self._saved = termios.tcgetattr(self._terminal)
        changed = termios.tcgetattr(self._terminal)
        changed[3] &= ~(termios.ECHO | termios.ICANON)
        changed[6][termios.VSUSP] = b"\0"
        termios.tcsetattr(self._terminal, termios.TCSAFLUSH, changed)
        return self

    def __exit__(self, *_: object) -> None:
        # Repeats that arrive late do not reach the shell.
        termios.tcsetattr(self._terminal, termios.TCSAFLUSH, self._saved)

    def read(self) -> list[str]:
        """Return the keys since the last call: characters, and ``"up"`` to ``"left"``."""
        while not self.closed and select.select([self._terminal], [], [], 0.0)[0]:
            try:
                data = os.read(self._terminal, 1024)
            except OSError:
                data = b""
            self.closed = not data
            self._rest += data.decode("ascii", "replace")
        keys: list[str] = []
        while self._rest and not _PARTIAL.match(self._rest):
            if found := _SEQUENCE.match(self._rest):
                if (arrow := _ARROWS.get(found[2])) and not found[1]:
                    keys.append(arrow)
                self._rest = self._rest[found.end() :]
            else:
                keys.append(self._rest[0])
                self._rest = self._rest[1:]
        return keys


@contextmanager
def motion_keys(output: Output) -> Iterator[Keyboard | None]:
    """Read the keys for a motion, within a block of code, and name them; None without a terminal.

    A process in the background gets none: the system would suspend it for reading them.
    """
    if not sys.stdin.isatty() or _in_background(sys.stdin.fileno()):
        yield None
        return
    with Keyboard() as keyboard:
        output.line("keys: p pauses the motion, c continues it; Ctrl-C stops")
        yield keyboard


def _in_background(terminal: int) -> bool:
    try:
        return os.tcgetpgrp(terminal) != os.getpgrp()
    except OSError:
        # Of a terminal that is not the one of its session.
        return False
