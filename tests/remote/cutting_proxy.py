"""A proxy between a client and an owner or a gateway, which cuts connections at any byte."""

from __future__ import annotations

import select
import socket
import threading
from contextlib import suppress
from typing import Any

UP, DOWN = "up", "down"


class Proxy:
    """Passes connections on, and cuts them.

    Args:
        listener: Takes the connections of clients; bound to its address.
        family: Family of the address to which they are passed on.
        address: That address.

    Attributes:
        passed: Bytes that have passed in each direction.
        accepting: Whether clients can connect.
    """

    def __init__(self, listener: socket.socket, family: int, address: Any) -> None:
        self._listener, self._family, self._address = listener, family, address
        self._listener.listen(64)
        self.passed = {UP: 0, DOWN: 0}
        self.accepting = True
        self._cut_at: tuple[str, int] | None = None
        self._peers: dict[socket.socket, tuple[socket.socket, str]] = {}
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def cut_after(self, direction: str, count: int) -> None:
        """End the connections once so many more bytes have passed in a direction."""
        with self._lock:
            self._cut_at = direction, self.passed[direction] + count

    def cut(self) -> None:
        """End all connections."""
        with self._lock:
            self._cut()

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self._cut()
        self._listener.close()

    def _cut(self) -> None:
        self._cut_at = None
        for end in self._peers:
            end.close()
        self._peers.clear()

    def _run(self) -> None:
        while not self._ended.is_set():
            with self._lock:
                ends = [self._listener, *self._peers]
            with suppress(OSError, ValueError):
                ready, _, _ = select.select(ends, [], [], 0.01)
                with self._lock:
                    for end in ready:
                        if end is self._listener:
                            self._accept()
                        elif end in self._peers:
                            self._forward(end)

    def _accept(self) -> None:
        client, _ = self._listener.accept()
        if not self.accepting:
            client.close()
            return
        owner = socket.socket(self._family, socket.SOCK_STREAM)
        owner.connect(self._address)
        self._peers[client] = owner, UP
        self._peers[owner] = client, DOWN

    def _forward(self, source: socket.socket) -> None:
        sink, direction = self._peers[source]
        data, left = b"", None
        with suppress(OSError):
            data = source.recv(1 << 16)
            if self._cut_at is not None and self._cut_at[0] == direction:
                left = self._cut_at[1] - self.passed[direction]
            self.passed[direction] += len(data[:left])
            sink.sendall(data[:left])
        if left is not None and len(data) >= left:
            self._cut()
        elif not data:
            for end in (source, sink):
                del self._peers[end]
                end.close()
