"""Ctrl-C as a request: a motion is never interrupted midway, it is requested to stop."""

from __future__ import annotations

import signal
from types import FrameType
from typing import Self

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interruption:
    """While entered, Ctrl-C, SIGTERM and SIGHUP only set a flag that the motion polls.

    Further signals change nothing: the arm is stopping already, and must end up disabled. Main
    thread only.

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
