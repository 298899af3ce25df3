"""The socket of an owner on this computer, with messages in msgpack."""

from __future__ import annotations

import os
import socket
import struct

from bioscara.api import framing, messages as m
from bioscara.api.direct_stop import stop_directly
from bioscara.api.runtime import OwnerEntry, find, has_ended, require_name, require_trusted
from bioscara.errors import OwnerLostError

_CHUNK = 1 << 16


class OwnerSocket:
    """The way to the owner of an arm on this computer; a ``Transport``.

    Args:
        name: Name of the owner.
        pid: Process of the owner, which no other one may be; None for any.

    Raises:
        InvalidArgumentError: No arm can have that name.
    """

    pause, silence = 0.05, 2.0

    def __init__(self, name: str, pid: int | None = None) -> None:
        self.name, self._pid = require_name(name), pid
        self._owner: OwnerEntry | None = None

    def encoded(self, message: object) -> bytes:
        """Return a message as msgpack."""
        return framing.packed(message)

    def direct_stop(self, client: str, session: str) -> None:
        """Stop all motion by the owner's second socket; errors as of a ``Transport``."""
        stop_directly(find(self.name), client, session)

    def connect(self, patience: float) -> _SocketConnection:
        """Connect; arguments and errors as of a ``Transport``."""
        self._owner = find(self.name)
        path = self._owner.socket
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_CLOEXEC)
        try:
            connection.settimeout(patience)
            connection.setsockopt(
                socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.pack("@ll", int(patience), 0)
            )
            connection.connect(os.fspath(path))
            self._require_process(require_trusted(connection, path))
        except BaseException:
            connection.close()
            raise
        return _SocketConnection(connection, self.name)

    def ended(self) -> bool:
        """Return whether the owner has ended: no process has its lock any more."""
        return self._owner is not None and has_ended(self._owner)

    def _require_process(self, pid: int) -> None:
        """Raise OwnerLostError if the owner is another process than it has to be."""
        if self._pid not in (None, pid):
            raise OwnerLostError(
                f"the owner of arm {self.name} is process {pid}, and not process {self._pid}, "
                "which this program has started"
            )


class _SocketConnection:
    """A connection to that socket; a ``TransportConnection``."""

    def __init__(self, connection: socket.socket, name: str) -> None:
        self._socket, self._name = connection, name
        self._frames = framing.MessageSplitter(framing.ANSWER_MAX)

    def send(self, data: bytes) -> None:
        self._socket.sendall(data)

    def receive(self) -> list[m.FromOwner]:
        messages: list[m.FromOwner] = []
        while not messages:
            data = self._socket.recv(_CHUNK)
            if not data:
                raise OwnerLostError(f"the owner of arm {self._name} ended the connection")
            messages = [framing.from_owner.decode(each) for each in self._frames.feed(data)]
        return messages

    def wait_turn(self, size: int) -> None:
        """Return: an owner reads no faster than it can."""

    def greeted(self) -> None:
        self._socket.settimeout(None)

    def end(self) -> None:
        self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        self._socket.close()
