"""The last request that was refused, for clients that see no answer."""

from __future__ import annotations

import time
from collections.abc import Callable

SHOWN = 10.0
"""Time for which the diagnostics have a refusal [s]."""


class Refusals:
    """Keeps the last refusal until a request is accepted, for :data:`SHOWN` at most.

    The original's panel shows no answer of a service, and a topic has none.

    Args:
        now: Returns the time [s].
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._last = ("", 0.0)

    def add(self, text: str) -> None:
        """Keep a refusal with its reason."""
        self._last = text, self._now()

    def clear(self) -> None:
        """Forget it: a later request was accepted."""
        self._last = "", 0.0

    @property
    def last(self) -> str:
        """The refusal; empty where there is none to show."""
        text, when = self._last
        return text if self._now() - when < SHOWN else ""
