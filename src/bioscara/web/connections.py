"""The connections of a gateway: their number, and which one is ended for another.

A connection without a credential keeps no other out: when there are too many, the oldest of them is
ended for the newest, wherever it comes from, as an operator may share the address of an attacker.
Those with a credential have places of their own, of which viewers can take a part. One that
finds none stays among the first kind, and gets a STOP through.
"""

from __future__ import annotations

import asyncio
import errno
import resource
import socket
from typing import Any

from bioscara.errors import ConfigurationError
from bioscara.robot.tasks.scope import Scope

KNOWN, VIEWERS = 256, 192
"""Largest number of connections with a credential, and of those that may only look."""
NEWCOMERS = 64
"""Places of those without."""
_FILES = 1024
"""Files that the gateway has open at most: for each connection one to the owner, and others."""
_AT_ONCE = 16
"""Connections that are accepted before others are read again."""
_NO_ROOM = {errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM}


class AcceptedConnection:
    """A connection of a client, from its acceptance to its end.

    Attributes:
        file: Number of its socket.
        client: Whose messages are counted together with its own; empty before a credential.
        scope: The rights of the credential that has come on it; None before.
        has_place: Whether it has one of the places of those with a credential.
    """

    def __init__(self, connections: Connections, accepted: socket.socket) -> None:
        self._connections, self._socket, self.file = connections, accepted, accepted.fileno()
        self._transport: asyncio.Transport | None = None
        self._timer: asyncio.TimerHandle | None = None
        self.client = ""
        self.scope: Scope | None = None
        self.has_place = False

    def carried_by(self, transport: asyncio.Transport) -> None:
        """Keep its transport, once TLS has begun."""
        self._transport = transport

    def admit(self, client: str, scope: Scope) -> bool:
        """Keep a credential; return whether there is a place for it."""
        self.client, self.scope = client, scope
        return self._connections.admit(self)

    def end_after(self, time: float | None) -> None:
        """End it after a time, unless another one is set before that [s]; None for no limit."""
        if self._timer is not None:
            self._timer.cancel()
        loop = asyncio.get_running_loop()
        self._timer = None if time is None else loop.call_later(time, self.end)

    def end(self) -> None:
        """End it, whatever waits to be sent."""
        if self._transport is not None:
            self._transport.abort()
            return
        try:
            # TLS has not begun: its transport sees the end, and closes the socket.
            self._socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            return


class Connections:
    """All connections of a gateway."""

    def __init__(self) -> None:
        self._all: dict[int, AcceptedConnection] = {}
        """By the numbers of their files, the oldest first."""
        self._newcomers: dict[int, AcceptedConnection] = {}
        self._places = {False: 0, True: 0}
        """Number of places that are taken, by whether their scope is to look only."""

    def __len__(self) -> int:
        return len(self._all)

    def find(self, file: int) -> AcceptedConnection:
        """Return the connection whose socket has a number."""
        return self._all[file]

    def opened(self, accepted: socket.socket) -> AcceptedConnection:
        """Take a new connection."""
        if len(self._newcomers) >= NEWCOMERS:
            self.end_oldest()
        made = AcceptedConnection(self, accepted)
        self._all[made.file] = self._newcomers[made.file] = made
        return made

    def closed(self, file: int) -> None:
        """Forget a connection."""
        connection = self._all.pop(file, None)
        self._newcomers.pop(file, None)
        if connection is not None:
            connection.end_after(None)
            if connection.has_place:
                self._places[connection.scope == Scope.VIEW] -= 1

    def end_oldest(self) -> bool:
        """End the oldest connection without a place; return whether there is one."""
        if not self._newcomers:
            return False
        # Not counted any more: its socket is closed a little later.
        self._newcomers.pop(next(iter(self._newcomers))).end()
        return True

    def admit(self, connection: AcceptedConnection) -> bool:
        """Give a connection with a credential a place, if it has none yet and there is one."""
        if connection.has_place:
            return True
        views = connection.scope == Scope.VIEW
        taken = sum(self._places.values())
        if taken >= KNOWN or (views and self._places[True] >= VIEWERS):
            return False
        self._places[views] += 1
        connection.has_place = True
        self._newcomers.pop(connection.file, None)
        return True


class Listener(socket.socket):
    """A socket that listens, and accepts few connections at once and in all.

    Attributes:
        connections: Those that it has accepted.
        patience: Time in which the first request of one has to come, after TLS [s].
    """

    connections: Connections
    patience: float
    _accepted = 0

    def accept(self) -> tuple[socket.socket, Any]:
        """Accept a connection.

        Raises:
            BlockingIOError: None waits, or others have their turn first.
            OSError: There is no memory, or no file is free.
        """
        if self._accepted >= _AT_ONCE:
            raise BlockingIOError
        if not self._accepted:
            asyncio.get_running_loop().call_soon(setattr, self, "_accepted", 0)
        self._accepted += 1
        try:
            plain, address = super().accept()
        except OSError as error:
            if error.errno in _NO_ROOM and self.connections.end_oldest():
                raise BlockingIOError from error
            raise
        made = _Accepted(plain.family, plain.type, plain.proto, fileno=plain.detach())
        made.connections = self.connections
        self.connections.opened(made).end_after(self.patience)
        return made, address


class _Accepted(socket.socket):
    """The socket of a connection, which says when it is closed."""

    connections: Connections

    def close(self) -> None:
        self.connections.closed(self.fileno())
        super().close()


def allow_files() -> None:
    """Let this process open as many files as a gateway needs.

    Raises:
        ConfigurationError: The system allows it too few.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    unlimited = hard == resource.RLIM_INFINITY
    if not unlimited and hard < _FILES:
        raise ConfigurationError(
            f"this process may open {hard} files, and a gateway needs {_FILES}: allow it more with "
            f"'ulimit -Hn {_FILES}', or LimitNOFILE={_FILES} in its service"
        )
    if soft < _FILES:
        resource.setrlimit(resource.RLIMIT_NOFILE, (_FILES if unlimited else hard, hard))
