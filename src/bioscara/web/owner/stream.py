"""A connection to the socket of an arm's owner, in JSON."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

from bioscara.api import framing, runtime
from bioscara.errors import AccessError, OwnerLostError

_CHUNK = 1 << 16


class OwnerStream:
    """One connection to the owner of an arm; messages are JSON that is not decoded yet."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer
        self._frames = framing.MessageSplitter(framing.ANSWER_MAX)

    @classmethod
    async def open(cls, arm: str) -> OwnerStream:
        """Connect to the owner of an arm.

        Raises:
            OwnerLostError: No owner of that name runs.
        """
        path = runtime.find(arm).socket
        try:
            # The limit is that of bytes that wait here: the owner leaves samples out beyond it.
            reader, writer = await asyncio.open_unix_connection(path, limit=_CHUNK)
            try:
                runtime.require_trusted(writer.get_extra_info("socket"), path)
            except BaseException:
                writer.close()
                raise
        except OSError as error:
            raise OwnerLostError(
                f"the owner of arm {arm} cannot be reached: {error.strerror}"
            ) from error
        except AccessError as error:
            raise OwnerLostError(str(error)) from error
        return cls(reader, writer)

    async def send(self, message: bytes) -> None:
        """Send a message; returns when the owner has taken most of the bytes.

        Raises:
            OSError: The owner has ended.
        """
        self._writer.write(framing.framed(message))
        await self._writer.drain()

    async def messages(self) -> AsyncIterator[bytes]:
        """Yield the messages of the owner, until it ends.

        Raises:
            OSError: The connection broke.
            ProtocolError: A message is too long.
        """
        while data := await self._reader.read(_CHUNK):
            for message in self._frames.feed(data):
                yield message

    def close(self, last: bytes = b"") -> None:
        """Disconnect, after a last message if one is given."""
        if last:
            self._writer.write(framing.framed(last))
        self._writer.close()
