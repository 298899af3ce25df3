"""The stops of an arm, counted, so that none is missed between two operations of one call."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from bioscara.errors import MotionCancelledError


class Call:
    """A call of a program, from its begin.

    Args:
        stops: The stops of the arm.
    """

    def __init__(self, stops: Stops) -> None:
        self._stops, self._begin = stops, stops.last

    @property
    def stopped(self) -> bool:
        """Whether a stop was requested since its begin."""
        return self._stops.last != self._begin

    def require(self, name: str) -> None:
        """Raise if a stop was requested since its begin.

        Args:
            name: Name of what does not begin any more.

        Raises:
            MotionCancelledError: It was.
        """
        if self.stopped:
            raise MotionCancelledError(f"{name} was stopped before anything moved")


class Stops:
    """Counts the stops of an arm that this process has heard of.

    Attributes:
        last: Number of the last one; 0 before the first.
    """

    def __init__(self) -> None:
        self.last = 0
        self._numbers = itertools.count(1)
        self._calls = threading.local()

    def note(self) -> None:
        """Count a stop, from any thread or signal handler; before it reaches the operations."""
        # Not by adding one: of two threads, one could set a number that a call began with.
        self.last = next(self._numbers)

    def call(self) -> Call:
        """Return the call of this thread, which begins now unless it is within :meth:`one_call`."""
        return getattr(self._calls, "call", None) or Call(self)

    @contextmanager
    def one_call(self) -> Iterator[Call]:
        """Let the calls of this thread, within a block of code, be one; yield it."""
        outer: Call | None = getattr(self._calls, "call", None)
        self._calls.call = outer or Call(self)
        try:
            yield self._calls.call
        finally:
            self._calls.call = outer
