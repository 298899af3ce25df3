"""Messages for a client that reads slowly: the newest sample, and a bounded queue of the rest."""

from __future__ import annotations

import asyncio
from collections import deque

MOST = 256 << 10
"""Waiting bytes above which no more are taken, other than samples [byte]."""
_SAMPLE = b'{"kind":"state",'
"""Begin of a state sample: an encoded struct begins with its kind."""


class Outbox:
    """Messages on their way to a client; a sample replaces one that still waits."""

    def __init__(self) -> None:
        self._messages: deque[bytes] = deque()
        self._sample: bytes | None = None
        self._size, self._ended = 0, False
        self._changed, self._room = asyncio.Event(), asyncio.Event()
        self._room.set()

    async def put(self, message: bytes) -> None:
        """Add a message; waits while too much waits."""
        if message.startswith(_SAMPLE):
            self._sample = message
        else:
            await self._room.wait()
            self._messages.append(message)
            self._size += len(message)
            if self._size > MOST:
                self._room.clear()
        self._changed.set()

    def end(self) -> None:
        """Let :meth:`take` return None once nothing waits."""
        self._ended = True
        self._changed.set()

    async def take(self) -> bytes | None:
        """Return the next message once there is one; None at the end."""
        while True:
            if self._messages:
                message = self._messages.popleft()
                self._size -= len(message)
                if self._size <= MOST:
                    self._room.set()
                return message
            if self._sample is not None:
                sample, self._sample = self._sample, None
                return sample
            if self._ended:
                return None
            self._changed.clear()
            await self._changed.wait()
