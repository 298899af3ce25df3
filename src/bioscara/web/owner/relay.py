"""One WebSocket of a browser or program, joined to a connection of its own to the owner.

The relay is a filter: it passes the messages that the scope of the client allows, and gives the
owner the client's name. Lease, session and answers are the owner's. A slow client gets the newest
sample; of other messages few wait here, then the owner's own limits apply.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
from collections.abc import Callable, Coroutine
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

import msgspec
from fastapi import WebSocket, WebSocketDisconnect

from bioscara.api import framing, messages as m
from bioscara.api.direct_stop import USUAL
from bioscara.api.failures import failure_of
from bioscara.errors import AccessError, BioscaraError, OwnerLostError, ProtocolError
from bioscara.printing import printable
from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.browser_sessions import BrowserSession, BrowserSessions
from bioscara.web.owner.outbox import Outbox
from bioscara.web.owner.queries import stop_at_loop
from bioscara.web.owner.stream import OwnerStream

SEND_TIMEOUT = 20.0
"""Time for which a client may read nothing until it is cut off [s]."""
STOP_TIMEOUT = 5.0
"""Time that a client has to send a STOP, and to read its answer, that may send nothing else [s]."""
_AWAY = 1001
"""Code with which a browser closes the WebSocket of a page that is closed or left."""
_UNSUPPORTED, _INVALID, _REFUSED, _RESTART, _LATER = 1003, 1007, 1008, 1012, 1013
"""Codes with which a WebSocket is closed, of RFC 6455 and its registry."""
_REFUSAL = b'{"kind":"refusal","id":null,'
"""Begin of a refusal after which the owner ends the connection: a struct begins with its kind."""


class _Numbered(msgspec.Struct):
    """The number that answers have."""

    id: int | None = None


_numbered = msgspec.json.Decoder(_Numbered)
_failed = msgspec.json.Decoder(m.RequestFailed)
_log = logging.getLogger(__name__)


class WebClient(NamedTuple):
    """The client at the other end of a WebSocket.

    Attributes:
        scope: Its rights.
        address: Its address.
        browser: Value of its cookie; empty for a program.
    """

    scope: Scope
    address: str
    browser: str = ""

    def named(self, name: str) -> str:
        """Return a name for messages to people, with scope and address."""
        suffix = f" ({self.scope.name.lower()}, {self.address})"
        return printable(name)[: m.NAME_MAX - len(suffix)] + suffix

    def session(self, name: str) -> str:
        """Return the owner's name of a session that the client calls ``name``.

        It differs between scopes and between browsers: a client that knows the name of another
        one's session must not get its lease or its answers with a lesser token, from another
        browser, or from the web.
        """
        scoped = f"web {self.scope.name} {self.browser} {name}"
        return hashlib.sha256(scoped.encode()).hexdigest()


class Closing(NamedTuple):
    """Why a WebSocket is closed.

    Attributes:
        code: The code.
        reason: In words.
    """

    code: int
    reason: str


class Relay:
    """Joins a WebSocket to the owner of an arm.

    Args:
        websocket: The WebSocket, accepted.
        arm: Name of the owner.
        client: The client at its other end.
        full: Why the client may send nothing but a STOP; empty if it may.
    """

    def __init__(self, websocket: WebSocket, arm: str, client: WebClient, full: str = "") -> None:
        self._websocket, self._arm, self._client, self._full = websocket, arm, client, full
        self._left = asyncio.Event()
        self._outbox = Outbox()
        self._greeted = self._page_left = False
        self._welcomed = asyncio.Event()
        self._refusal: m.FailureValue | None = None
        self._hello: m.ClientHello | None = None
        self._stops: dict[int, asyncio.Task[None]] = {}
        """What watches each STOP that has no answer yet, by the number of its request."""

    async def run(self, sessions: BrowserSessions, session: BrowserSession | None) -> None:
        """Relay until one side ends, then close the WebSocket with the reason.

        Args:
            sessions: The signed-in browsers.
            session: That of the client; None for a program.
        """
        closing: Closing | None
        try:
            owner = await OwnerStream.open(self._arm)
        except OwnerLostError as error:
            await self._close(Closing(_LATER, str(error)))
            return
        used = None if session is None else partial(sessions.use, session)
        ends: list[Coroutine[Any, Any, Closing | None]] = [self._up(owner, used), self._down()]
        if session is not None:
            ends.append(_signed_out(sessions, session))
        if self._full:
            ends.append(self._leave())
        try:
            closing = await self._relayed(owner, ends)
        finally:
            owner.close(self._farewell())
            for task in self._stops.values():
                task.cancel()
        if closing is not None:
            await self._close(closing)

    def _farewell(self) -> bytes:
        """Return the last message to the owner: the motions of a client must not go on without it.

        A browser may have a page that connects again; the lease of that one lapses.
        """
        if not self._greeted or (self._client.browser and not self._page_left):
            return b""
        return framing.encode_json(m.Leave(may_return=not self._client.browser))

    def end(self) -> None:
        """End it for another one, if it may only send a STOP."""
        self._left.set()

    async def _relayed(
        self, owner: OwnerStream, ends: list[Coroutine[Any, Any, Closing | None]]
    ) -> Closing | None:
        loop = asyncio.get_running_loop()
        tasks = [loop.create_task(each) for each in ends]
        taking = loop.create_task(self._take(owner))
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            # In the order of the tasks: the error of the client says more than its consequence.
            return next(task for task in tasks if task in done).result()
        finally:
            for task in (*tasks, taking):
                task.cancel()
            await asyncio.gather(*tasks, taking, return_exceptions=True)

    async def _leave(self) -> Closing:
        """Wait for the end of a client that may only send a STOP."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._left.wait(), STOP_TIMEOUT)
        return Closing(_LATER, self._full)

    async def _take(self, owner: OwnerStream) -> None:
        """Take the messages of the owner, until it ends."""
        try:
            async for message in owner.messages():
                if message.startswith(_REFUSAL):
                    self._refusal = _failed.decode(message).failure
                else:
                    self._welcomed.set()
                if self._stops and (answered := self._stops.pop(_answered(message), None)):
                    if answered.done():
                        # It was answered here, as this one comes late.
                        continue
                    answered.cancel()
                await self._outbox.put(message)
        except (OSError, ProtocolError, msgspec.DecodeError) as error:
            _log.warning("the connection to the owner of arm %s broke: %s", self._arm, error)
        self._outbox.end()
        # The other task closes the WebSocket, after the messages that still wait.
        await asyncio.Event().wait()

    async def _down(self) -> Closing | None:
        """Pass the messages of the owner on, each as it is."""
        try:
            while (message := await self._outbox.take()) is not None:
                await self._send(message)
        except TimeoutError:
            # It would not read a reason either.
            _log.warning(
                "client %s is cut off: it read nothing for %g s", self._client.address, SEND_TIMEOUT
            )
            return None
        except WebSocketDisconnect:
            return None
        return self._end()

    def _end(self) -> Closing:
        """Return why the owner has ended the connection: a client that may connect again does."""
        if self._refusal is not None:
            return Closing(_REFUSED, self._refusal.text)
        if not self._greeted:
            return Closing(_REFUSED, "the connection ended before a hello came")
        return Closing(_RESTART, f"the owner of arm {self._arm} has ended")

    async def _up(self, owner: OwnerStream, used: Callable[[], None] | None) -> Closing | None:
        """Pass the messages of the client on that it may send."""
        while True:
            received = await self._websocket.receive()
            if received["type"] == "websocket.disconnect":
                self._page_left = received.get("code") == _AWAY
                return None
            if used is not None:
                used()
            text = received.get("text")
            if text is None:
                return Closing(_UNSUPPORTED, "a message is JSON, as text")
            try:
                closing = await self._pass(owner, text.encode())
            except (TimeoutError, WebSocketDisconnect):
                return None
            except OSError:
                return self._end()
            if closing is not None:
                return closing

    async def _pass(self, owner: OwnerStream, payload: bytes) -> Closing | None:
        """Pass one message on, or refuse it; returns why the WebSocket is to be closed, if so."""
        try:
            message = framing.json_from_client.decode(payload)
        except msgspec.ValidationError as error:
            number = _number(payload) if self._greeted else None
            await self._refuse(number, framing.unusable(error))
            return None if number is not None else Closing(_INVALID, "a message cannot be used")
        except (msgspec.DecodeError, RecursionError) as error:
            await self._refuse(None, framing.unusable(error))
            return Closing(_INVALID, "a message cannot be read")
        if isinstance(message, m.ClientHello):
            if self._greeted:
                await self._refuse(None, ProtocolError("hello came twice"))
                return Closing(_REFUSED, "hello came twice")
            self._greeted = True
            self._hello = self._introduced(message)
            await owner.send(framing.encode_json(self._hello))
            return None
        if not self._greeted:
            await self._refuse(None, ProtocolError("a request came before hello"))
            return Closing(_REFUSED, "a request came before hello")
        if self._full and not _is_stop(message):
            self._left.set()
        elif isinstance(message, m.ClientRequest) and (text := self._beyond_scope(message.command)):
            await self._refuse(message.id, AccessError(text))
        else:
            if isinstance(message, m.ClientRequest) and _is_stop(message):
                task = asyncio.get_running_loop().create_task(self._stop_directly(message.id))
                self._stops[message.id] = task
            if isinstance(message, m.ClientRequest) and isinstance(message.command, m.Pause):
                payload = framing.encode_json(self._as_author(message))
            # A message to an owner that has refused the hello would break the connection, and its
            # refusal would be lost.
            await self._welcomed.wait()
            await owner.send(payload)
        return None

    async def _stop_directly(self, number: int) -> None:
        """Carry a STOP out at the control loop, if the owner's usual process does not answer."""
        await asyncio.sleep(USUAL)
        assert self._hello is not None  # noqa: S101  it has greeted
        answer: m.Response | m.RequestFailed = m.Response(number, m.Done())
        try:
            await stop_at_loop(self._arm, self._hello.client, self._hello.session)
        except OwnerLostError as error:
            answer = m.RequestFailed(number, failure_of(error))
        await self._outbox.put(framing.encode_json(answer))

    def _beyond_scope(self, command: m.AnyCommand) -> str:
        """Return why the client may not give a command; empty if it may."""
        needed = command.required_scope
        if needed <= self._client.scope:
            return ""
        what = command.task if isinstance(command, m.Start) else command
        return (
            f"{what.__struct_config__.tag} needs the scope {needed.name.lower()}, and this client "
            f"has {self._client.scope.name.lower()}; open the page with another token"
        )

    def _as_author(self, request: m.ClientRequest) -> m.ClientRequest:
        """Return a request to pause that says whether this client may resume."""
        command = m.Pause(may_resume=m.Resume().required_scope <= self._client.scope)
        return msgspec.structs.replace(request, command=command)

    def _introduced(self, hello: m.ClientHello) -> m.ClientHello:
        """Return a hello with the full name of the client and of its session."""
        name, session = hello.client, hello.session
        if 0 < len(name) <= m.NAME_MAX:
            name = self._client.named(name)
        if 0 < len(session) <= m.NAME_MAX:
            session = self._client.session(session)
        return msgspec.structs.replace(hello, client=name, session=session)

    async def _refuse(self, number: int | None, error: BioscaraError) -> None:
        await self._send(framing.encode_json(m.RequestFailed(number, failure_of(error))))

    async def _send(self, message: bytes) -> None:
        async with asyncio.timeout(SEND_TIMEOUT):
            await self._websocket.send({"type": "websocket.send", "text": message.decode()})

    async def _close(self, closing: Closing) -> None:
        # A reason has at most 123 bytes.
        reason = closing.reason.encode()[:123].decode(errors="ignore")
        try:
            async with asyncio.timeout(SEND_TIMEOUT):
                await self._websocket.close(closing.code, reason)
        except (TimeoutError, RuntimeError, WebSocketDisconnect):
            # It does not read, or has left.
            return


async def _signed_out(sessions: BrowserSessions, session: BrowserSession) -> Closing:
    """Wait for the end of a credential."""
    return Closing(_REFUSED, await sessions.ended(session))


def _is_stop(message: m.ClientRequest | m.Received) -> bool:
    return isinstance(message, m.ClientRequest) and isinstance(message.command, m.StopAll)


def _answered(message: bytes) -> int:
    """Return the number of the request that a message of the owner answers; 0 if it is none."""
    return _numbered.decode(message).id or 0


def _number(payload: bytes) -> int | None:
    """Return the number of a request that is otherwise wrong; None if it has none."""
    try:
        message = msgspec.json.decode(payload)
    except (msgspec.DecodeError, RecursionError):
        return None
    number = message.get("id") if isinstance(message, dict) else None
    return number if isinstance(number, int) else None
