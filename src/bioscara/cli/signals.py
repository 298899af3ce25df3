"""Ctrl-C and the signals that end a process, while a command drives an arm or writes a board."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Self

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StopRequest:
    """While entered, Ctrl-C, SIGTERM and SIGHUP only set a flag that the motion polls.

    A motion is never interrupted midway. Further signals change nothing: the arm is stopping
    already, and must end up disabled. Main thread only.

    Attributes:
        requested: True once a signal arrived.
    """

    def __init__(self) -> None:
        self.requested = False

    def __call__(self) -> bool:
        """Return whether to stop."""
        return self.requested

    def __enter__(self) -> Self:
        self._previous = [(number, signal.signal(number, self._mark)) for number in _SIGNALS]
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._previous:
            signal.signal(number, handler)

    def _mark(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002 (signal's form)
        # A plain attribute: an Event's lock could be held by the thread interrupted here.
        self.requested = True


@contextmanager
def raising_keyboard_interrupt() -> Iterator[None]:
    """Handle SIGTERM and a closed terminal as Ctrl-C, as a KeyboardInterrupt."""
    numbers = (signal.SIGTERM, signal.SIGHUP)
    before = [(number, signal.signal(number, signal.default_int_handler)) for number in numbers]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)
