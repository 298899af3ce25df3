"""The socket for STOP alone, which the control loop reads itself."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from bioscara.api.direct_stop import LONGEST
from bioscara.api.messages import NAME_MAX
from bioscara.api.runtime import OwnerClaim
from bioscara.printing import printable
from bioscara.server.clients.peer import may_use

_AT_ONCE = 16
"""Connections that are taken in a cycle, and that may wait for their message."""
_PATIENCE = 0.05
"""Time in which a connection has to send its message [s]."""


@dataclass(slots=True)
class StoppingClient:
    """A client that stops all motion.

    Attributes:
        session: Name of its session.
        name: Name of the client.
    """

    session: str
    name: str


class StopSocket:
    """Takes the STOPs that wait at the socket, each cycle.

    Args:
        claim: Has the socket.
        group: Number of the group whose members may be clients; None for this user alone.
        stop: Called with the clients that stop all motion, in the thread of the control loop.
    """

    def __init__(
        self,
        claim: OwnerClaim,
        group: int | None,
        stop: Callable[[list[StoppingClient]], object],
    ) -> None:
        self._claim, self._group, self._stop = claim, group, stop
        self._waiting: list[tuple[socket.socket, float]] = []

    def look(self, _: object = None) -> None:
        """Carry out what waits; called at the end of each cycle, raises nothing and never waits."""
        self._accept()
        if not self._waiting:
            return
        now, waiting = time.monotonic(), []
        clients: list[tuple[socket.socket, StoppingClient]] = []
        for connection, due in self._waiting:
            try:
                message = connection.recv(LONGEST)
            except BlockingIOError:
                if now < due:
                    waiting.append((connection, due))
                    continue
                message = b""
            except OSError:
                message = b""
            if (client := _client(message)) is None:
                connection.close()
            else:
                clients.append((connection, client))
        self._waiting = waiting
        if clients:
            self._stop([client for _, client in clients])
        for connection, _ in clients:
            with connection, suppress(OSError):
                connection.send(b'{"kind":"done"}')

    def _accept(self) -> None:
        while len(self._waiting) < _AT_ONCE:
            try:
                connection, _ = self._claim.stops.accept()
            except OSError:
                # None waits; or the socket is being made again.
                return
            connection.setblocking(False)
            if may_use(connection, self._group):
                self._waiting.append((connection, time.monotonic() + _PATIENCE))
            else:
                connection.close()


def _client(message: bytes) -> StoppingClient | None:
    """Return the client of a message; None if it is no STOP."""
    with suppress(ValueError, KeyError, TypeError, AttributeError, RecursionError):
        values = json.loads(message)
        if values["kind"] == "stop":
            session, name = values["session"][:NAME_MAX], values["client"][:NAME_MAX]
            return StoppingClient(str(session), printable(str(name)))
    return None
