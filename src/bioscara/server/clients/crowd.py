"""All connections of an owner: their number, their shares of its time, and the events of them."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from bioscara.errors import BusyOwnerError
from bioscara.server.clients.arm_service import ArmService

if TYPE_CHECKING:
    from bioscara.server.clients.connection import Connection

CLIENTS, EACH = 200, 120
"""Largest number of connections, and of those of one process."""
RESERVED = 16
"""Further connections, which may only send STOP."""
_BURST = 2e-3
"""Time for which requests of one client are carried out before others have a turn [s]."""
_PART = 0.5
"""Share of the time that the requests of all clients may take which have no rest."""
_EVENTS, _PERIOD = 50, 10.0
"""Comings and goings in a time [s] of which each is an event; further ones are counted."""


class Crowd:
    """The connections.

    Args:
        service: The arm.

    Attributes:
        connections: The open connections.
        resting: Number of connections that wait for their share.
        work_bytes: Length of all requests in work [byte].
    """

    def __init__(self, service: ArmService) -> None:
        self._service = service
        self.connections: set[Connection] = set()
        self.resting = self.work_bytes = 0
        self._told, self._untold = 0, 0
        self._timer: asyncio.TimerHandle | None = None

    def is_full(self, process: int) -> bool:
        """Return whether a process can have no usual connection any more."""
        usual = [each for each in self.connections if not each.only_stop]
        own = sum(each.peer.pid == process for each in usual) if process else 0
        return len(usual) >= CLIENTS or own >= EACH

    def make_room(self) -> None:
        """Close the oldest connection for STOP, if all of these are taken."""
        # Many connections may come in one turn of the loop, in which the closed ones still count.
        reserved = [each for each in self.connections if each.only_stop and not each.ending]
        if len(reserved) >= RESERVED:
            min(reserved, key=lambda each: each.number).cut_off("a newer one has its place")

    def limit_waiting(self, most: int) -> None:
        """Cut the client off for which most waits, if more waits for all of them.

        Args:
            most: Largest length of the answers that wait [byte].
        """
        if sum(each.waiting for each in self.connections) > most:
            fullest = max(self.connections, key=lambda each: each.waiting)
            fullest.cut_off("it does not read its answers, and too much waits for all clients")

    def full(self) -> BusyOwnerError:
        """Return the refusal of a client that may only send STOP."""
        return BusyOwnerError(
            f"arm {self._service.name} has {CLIENTS} clients, or {EACH} of this program, already; "
            "only STOP is carried out; close connections that are not needed"
        )

    def announce(self, text: str, client: str) -> None:
        """Add the event of a client that comes or goes, unless there are too many."""
        if self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(_PERIOD, self._tell)
        if self._told < _EVENTS:
            self._told += 1
            self._service.announce("client", text, client)
        else:
            self._untold += 1

    def _tell(self) -> None:
        untold, self._told, self._untold, self._timer = self._untold, 0, 0, None
        if untold:
            text = f"{untold} more clients have connected or left in {_PERIOD:g} s"
            self._service.announce("client", text, "")


class Share:
    """The time that the requests of one client may take in the process of all.

    A client that has used its time up rests, so that all that do this share half of the time: a
    STOP of another one waits for one turn of each at most.

    Args:
        crowd: All connections.
    """

    def __init__(self, crowd: Crowd) -> None:
        self._crowd = crowd
        self._loop = asyncio.get_running_loop()
        self._left, self._time, self._begun = _BURST, self._loop.time(), 0.0
        self._resting = False

    def begin(self) -> None:
        """Begin a turn."""
        now = self._loop.time()
        self._left = min(self._left + (now - self._time) * self._rate, _BURST)
        self._time = self._begun = now

    @property
    def used_up(self) -> bool:
        """Whether the turn is over."""
        return self._loop.time() - self._begun >= self._left

    def rest(self) -> float:
        """End the turn; return the time for which the client has to rest [s]."""
        now = self._loop.time()
        self._left -= now - self._begun
        self._time = self._begun = now
        over = self._left <= 0.0
        self._crowd.resting += over - self._resting
        self._resting = over
        return (_BURST / 2 - self._left) / self._rate if over else 0.0

    def end(self) -> None:
        """The client has left."""
        self._crowd.resting -= self._resting
        self._resting = False

    @property
    def _rate(self) -> float:
        return _PART / max(self._crowd.resting, 1)
