"""Numbered events, of which the latest are kept for clients that connect again."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

from bioscara.api.framing import Framed
from bioscara.api.messages import Event, EventKind, FaultValue, GoalValue, LeaseValue

KEPT = 10_000
"""Number of events that are kept."""


class Events:
    """The events of an owner.

    Args:
        clock: Returns the time on the arm's clock [s].
        wall: Returns the time since 1970 [s].

    Attributes:
        last: Number of the newest event; 0 before the first.
    """

    def __init__(self, clock: Callable[[], float], wall: Callable[[], float] = time.time) -> None:
        self._clock, self._wall = clock, wall
        self._kept: deque[Event] = deque(maxlen=KEPT)
        self._framed: tuple[Event | None, Framed] = None, Framed(None)
        self.last = 0

    def add(
        self,
        what: EventKind,
        text: str,
        client: str = "",
        *,
        goal: GoalValue | None = None,
        fault: FaultValue | None = None,
        lease: LeaseValue | None = None,
    ) -> Event:
        """Add an event; arguments as its fields."""
        event = Event(
            number=self.last + 1,
            time=self._clock(),
            wall=self._wall(),
            what=what,
            text=text,
            client=client,
            goal=goal,
            fault=fault,
            lease=lease,
        )
        self.keep(event)
        return event

    def keep(self, event: Event) -> None:
        """Keep an event that has its number: that of the last one and one."""
        self._kept.append(event)
        # Last: the event is there for other threads that see its number.
        self.last = event.number

    def framed(self, event: Event) -> Framed:
        """Return an event as bytes for the socket; made once for all clients."""
        if self._framed[0] is not event:
            self._framed = event, Framed(event)
        return self._framed[1]

    def after(self, number: int) -> Event | None:
        """Return the event that follows a number; None if there is none yet.

        If it is not kept any more, this is a ``gap`` whose number is the last that is missing.
        """
        number = max(number, 0)
        if number >= self.last:
            return None
        first = self._kept[0].number
        if number + 1 < first:
            missing = first - 1 - number
            return Event(
                number=first - 1,
                time=self._clock(),
                wall=self._wall(),
                what="gap",
                text=f"{missing} events are not kept any more, up to number {first - 1}",
            )
        return self._kept[number + 1 - first]
