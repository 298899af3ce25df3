"""Questions to the owner of an arm that are asked by HTTP, over one connection."""

from __future__ import annotations

import asyncio
import itertools
import secrets
from typing import Any

import msgspec

from bioscara.api import framing, messages as m, runtime
from bioscara.api.direct_stop import USUAL, stop_directly
from bioscara.errors import AccessError, OwnerLostError, ProtocolError
from bioscara.web.owner.stream import OwnerStream

_ANSWER_TIMEOUT = 60.0
"""Longest time to wait for an answer [s]: planning takes a second at most."""
_HELLO_TIMEOUT = 5.0


class _Answer(msgspec.Struct):
    """The fields of a message that a request needs, and its result as JSON as it came."""

    kind: str
    id: int | None = None
    result: msgspec.Raw = msgspec.Raw()
    failure: m.FailureValue | None = None


_answer = msgspec.json.Decoder(_Answer)


class RequestFailedError(Exception):
    """The owner refused a request, or it failed.

    Attributes:
        failure: Why.
    """

    def __init__(self, failure: m.FailureValue) -> None:
        self.failure = failure
        super().__init__(failure.text)


class OwnerQueries:
    """A client that asks an owner for results; it connects when it is asked, and again.

    Args:
        arm: Name of the owner.
        client: Name of the client, for messages to people.
        session: Name of its session; empty for one of its own.
    """

    def __init__(self, arm: str, client: str, session: str = "") -> None:
        self._arm, self._client, self._session = arm, client, session
        self._numbers = itertools.count(1)
        self._pending: dict[int, asyncio.Future[bytes]] = {}
        self._stream: OwnerStream | None = None
        self._reading: asyncio.Task[None] | None = None
        self._opening = asyncio.Lock()

    async def ask(self, command: m.AnyCommand) -> bytes:
        """Return the result of a command as JSON.

        Raises:
            OwnerLostError: The owner does not run or does not answer.
            RequestFailedError: The owner refused the request.
        """
        async with self._opening:
            if self._stream is None:
                await self._open()
            stream = self._stream
        assert stream is not None  # noqa: S101  just opened
        number = next(self._numbers)
        answer: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
        self._pending[number] = answer
        try:
            if self._stream is not stream:
                raise OwnerLostError(f"the owner of arm {self._arm} has ended")
            await stream.send(framing.encode_json(m.ClientRequest(id=number, command=command)))
            return await asyncio.wait_for(answer, _ANSWER_TIMEOUT)
        except (OSError, TimeoutError) as error:
            raise OwnerLostError(f"the owner of arm {self._arm} gives no answer") from error
        finally:
            self._pending.pop(number, None)
            _settle(answer)

    async def stop(self) -> None:
        """Stop all motion, also where the process that answers the owner's clients hangs.

        Raises:
            OwnerLostError: The owner does not run, or did not confirm it.
            RequestFailedError: The owner refused it.
        """
        try:
            async with asyncio.timeout(USUAL):
                await self.ask(m.StopAll())
        except (TimeoutError, OwnerLostError):
            await stop_at_loop(self._arm, self._client, self._session)

    async def close(self) -> None:
        """Disconnect."""
        if self._reading is not None:
            self._reading.cancel()
            await asyncio.gather(self._reading, return_exceptions=True)
        if self._stream is not None:
            self._stream.close()
            self._stream = None

    async def _open(self) -> None:
        stream = await OwnerStream.open(self._arm)
        session = self._session or secrets.token_hex(16)
        hello = m.ClientHello(version=m.VERSION, client=self._client, session=session)
        loop = asyncio.get_running_loop()
        greeted: asyncio.Future[None] = loop.create_future()
        self._stream, self._reading = stream, loop.create_task(self._read(stream, greeted))
        try:
            await stream.send(framing.encode_json(hello))
            await asyncio.wait_for(greeted, _HELLO_TIMEOUT)
        except BaseException as error:
            await self.close()
            if isinstance(error, OSError):  # a TimeoutError also
                text = f"the owner of arm {self._arm} does not answer"
                raise OwnerLostError(text) from error
            raise
        finally:
            _settle(greeted)

    async def _read(self, stream: OwnerStream, greeted: asyncio.Future[None]) -> None:
        lost: Exception = OwnerLostError(f"the owner of arm {self._arm} has ended")
        try:
            async for message in stream.messages():
                answer = _answer.decode(message)
                if answer.kind == "welcome" and not greeted.done():
                    greeted.set_result(None)
                elif answer.failure is not None and answer.id is None:
                    lost = RequestFailedError(answer.failure)
                elif (asked := self._pending.get(answer.id or 0)) and not asked.done():
                    if answer.failure is None:
                        asked.set_result(bytes(answer.result))
                    else:
                        asked.set_exception(RequestFailedError(answer.failure))
        except (OSError, ProtocolError, msgspec.DecodeError) as error:
            lost = OwnerLostError(f"the connection to the owner of arm {self._arm} broke: {error}")
        finally:
            stream.close()
            if self._stream is stream:
                self._stream = None
            futures: list[asyncio.Future[Any]] = [greeted, *self._pending.values()]
            for future in futures:
                if not future.done():
                    future.set_exception(lost)


async def stop_at_loop(arm: str, client: str, session: str) -> None:
    """Stop all motion by the owner's second socket.

    Args:
        arm: Name of the owner.
        client: Name of the client.
        session: Name of its session; empty for none.

    Raises:
        OwnerLostError: The owner does not run, or did not confirm it.
    """
    try:
        await asyncio.to_thread(stop_directly, runtime.find(arm), client, session)
    except AccessError as error:
        raise OwnerLostError(str(error)) from error


def _settle(future: asyncio.Future[Any]) -> None:
    """Take an error that no task waits for any more: asyncio would report it."""
    if future.done() and not future.cancelled():
        future.exception()
