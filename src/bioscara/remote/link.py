"""The connection of a program to an owner: requests, answers, events and records."""

from __future__ import annotations

import itertools
import os
import secrets
import socket
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import msgspec

from bioscara.api import framing
from bioscara.api import messages as m
from bioscara.api.failures import error_of
from bioscara.api.runtime import find
from bioscara.errors import OwnerLostError, ProtocolError

PATIENCE = 5.0
"""Time for which a broken connection is tried again before requests fail [s]."""
_PAUSE = 0.05
"""Pause between two tries [s]."""
_ANSWER_TIMEOUT = 60.0
"""Longest time to wait for an answer [s]: planning takes a second at most."""
_CHUNK = 1 << 16


class _Pending:
    """A request whose answer has not come."""

    __slots__ = ("answer", "come", "request")

    def __init__(self, request: m.ClientRequest) -> None:
        self.request = request
        self.come = threading.Event()
        self.answer: m.AnyResult | Exception | None = None

    def settle(self, answer: m.AnyResult | Exception) -> None:
        self.answer = answer
        self.come.set()


class OwnerLink:
    """A connection to the owner of an arm, made again when it breaks.

    A request whose answer was missed is never carried out twice: after connecting again its answer
    is recalled, and it is sent again only if it had not arrived. Used by any thread.

    Args:
        name: Name of the owner.
        receive: Called in the link's thread with each event, sample and record; must return at
            once.
        lost: Called there when the owner has ended or was restarted: what it did is over.
        events_after: Number after which events are received; None for new ones only.

    Attributes:
        name: As given.
        welcome: The owner's greeting at the last connection.
    """

    def __init__(
        self,
        name: str,
        receive: Callable[[m.FromOwner], object],
        lost: Callable[[OwnerLostError], object],
        *,
        events_after: int | None = None,
    ) -> None:
        self.name, self._receive, self._lost = name, receive, lost
        self._session = secrets.token_hex(16)
        self._client = _program()
        self._numbers = itertools.count(1)
        self._pending: dict[int, _Pending] = {}
        self._recalls: dict[int, int] = {}
        self._lock, self._sending = threading.Lock(), threading.Lock()
        self._socket: socket.socket | None = None
        self._subscription = m.Subscribe(events_after=0)
        self._events_after, self._last_event = events_after, 0
        self._closed = False
        self._failure: OwnerLostError | None = None
        self.welcome: m.Welcome
        self._reader: threading.Thread | None = None

    def open(self) -> None:
        """Connect.

        Raises:
            OwnerLostError: No owner of that name runs, or it does not answer.
            ProtocolError: It speaks another version.
        """
        frames, waiting = self._connect()
        newest = self.welcome.last_event
        self._last_event = newest if self._events_after is None else self._events_after
        self._subscribe()
        self._start_reading(frames, waiting)

    def _start_reading(self, frames: framing.Frames, waiting: list[m.FromOwner]) -> None:
        self._reader = threading.Thread(
            target=self._read,
            args=(frames, waiting),
            name=f"bioscara-link-{self.name}",
            daemon=True,
        )
        self._reader.start()

    def close(self) -> None:
        """Disconnect; may be called again."""
        self._closed = True
        self._drop()
        reader = self._reader
        if reader is not None and reader is not threading.current_thread():
            reader.join(PATIENCE)
        self._fail(OwnerLostError(f"the connection to arm {self.name} was closed"))

    def subscribe(self, *, states: bool, period: float = 0.0) -> None:
        """Let the owner send state samples, or not; events always come.

        Args:
            states: Whether to send them.
            period: Least time between two of them [s].
        """
        self._subscription = m.Subscribe(states=states, period=period, events_after=0)
        self._subscribe()

    def _subscribe(self) -> None:
        command = msgspec.structs.replace(self._subscription, events_after=self._last_event)
        self._send(m.ClientRequest(id=next(self._numbers), command=command))

    def request(self, command: m.AnyCommand, epoch: int | None = None) -> m.AnyResult:
        """Send a request and return its result.

        Args:
            command: What is requested.
            epoch: Epoch of the lease, for commands that need one.

        Raises:
            OwnerLostError: The owner does not run or does not answer.
            BioscaraError: The error of the owner.
        """
        if self._failure is not None:
            self._reopen()
        pending = _Pending(m.ClientRequest(id=next(self._numbers), command=command, epoch=epoch))
        with self._lock:
            self._pending[pending.request.id] = pending
        try:
            self._send(pending.request)
            if not pending.come.wait(_ANSWER_TIMEOUT):
                raise OwnerLostError(
                    f"the owner of arm {self.name} has not answered within {_ANSWER_TIMEOUT:g} s"
                )
        finally:
            with self._lock:
                self._pending.pop(pending.request.id, None)
        answer = pending.answer
        if isinstance(answer, Exception):
            raise answer
        if answer is None:
            raise OwnerLostError(f"the owner of arm {self.name} gave no answer")
        return answer

    def _reopen(self) -> None:
        with self._lock:
            if self._failure is None or self._closed:
                return
            frames, waiting = self._connect()
            self._last_event = self.welcome.last_event
            self._failure = None
        self._subscribe()
        self._start_reading(frames, waiting)

    def _connect(self) -> tuple[framing.Frames, list[m.FromOwner]]:
        """Return the frames after the greeting, and messages that came with it."""
        path = find(self.name).socket
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_CLOEXEC)
        try:
            connection.settimeout(PATIENCE)
            connection.connect(os.fspath(path))
            hello = m.ClientHello(version=m.VERSION, client=self._client, session=self._session)
            connection.sendall(framing.packed(hello))
            frames = framing.Frames(framing.ANSWER_MAX)
            messages: list[m.FromOwner] = []
            while not messages:
                data = connection.recv(_CHUNK)
                if not data:
                    raise OwnerLostError(f"the owner of arm {self.name} refuses this user")
                messages = [framing.from_owner.decode(each) for each in frames.feed(data)]
            connection.settimeout(None)
        except (OSError, msgspec.DecodeError) as error:
            connection.close()
            raise OwnerLostError(
                f"the owner of arm {self.name} cannot be reached: {error}"
            ) from error
        except BaseException:
            connection.close()
            raise
        greeting = messages.pop(0)
        if isinstance(greeting, m.RequestFailed):
            connection.close()
            raise error_of(greeting.failure)
        if not isinstance(greeting, m.Welcome):
            connection.close()
            raise ProtocolError(f"the owner of arm {self.name} does not greet")
        self._socket, self.welcome = connection, greeting
        return frames, messages

    def _send(self, request: m.ClientRequest) -> None:
        data = framing.packed(request)
        # A broken connection is noticed by the reader, which then recalls the answer.
        with self._sending, suppress(OSError):
            if (connection := self._socket) is not None:
                connection.sendall(data)

    def _read(self, frames: framing.Frames, waiting: list[m.FromOwner]) -> None:
        while not self._closed:
            for message in waiting:
                self._take(message)
            try:
                connection = self._socket
                data = b"" if connection is None else connection.recv(_CHUNK)
                if data:
                    waiting = [framing.from_owner.decode(each) for each in frames.feed(data)]
                    continue
            except (OSError, msgspec.DecodeError, ProtocolError):
                pass
            if self._closed:
                return
            try:
                frames, waiting = self._resume()
            except OwnerLostError as error:
                self._fail(error)
                return

    def _resume(self) -> tuple[framing.Frames, list[m.FromOwner]]:
        """Connect again, and ask for the answers that were missed.

        Raises:
            OwnerLostError: The owner has ended, or was restarted.
        """
        instance, end = self.welcome.instance, time.monotonic() + PATIENCE
        self._drop()
        while True:
            try:
                frames, waiting = self._connect()
                break
            except OwnerLostError:
                if self._closed or time.monotonic() >= end:
                    raise
                time.sleep(_PAUSE)
        if self.welcome.instance != instance:
            self._drop()
            raise OwnerLostError(
                f"the owner of arm {self.name} was restarted: the arm has stopped, and what it did "
                "is over"
            )
        self._subscribe()
        with self._lock:
            missed = list(self._pending.values())
        for pending in missed:
            number = next(self._numbers)
            self._recalls[number] = pending.request.id
            self._send(m.ClientRequest(id=number, command=m.Recall(request=pending.request.id)))
        return frames, waiting

    def _take(self, message: m.FromOwner) -> None:
        if isinstance(message, m.Response | m.RequestFailed):
            self._settle(message)
            return
        if isinstance(message, m.Event):
            self._last_event = message.number
        self._receive(message)

    def _settle(self, message: m.Response | m.RequestFailed) -> None:
        if message.id is None:
            return
        recalled = self._recalls.pop(message.id, None)
        with self._lock:
            pending = self._pending.get(message.id if recalled is None else recalled)
        if pending is None:
            return
        if isinstance(message, m.Response):
            pending.settle(message.result)
        elif recalled is not None and "has not arrived" in message.failure.text:
            self._send(pending.request)
        else:
            pending.settle(error_of(message.failure))

    def _fail(self, error: OwnerLostError) -> None:
        with self._lock:
            self._failure = error
            missed = list(self._pending.values())
        for pending in missed:
            pending.settle(OwnerLostError(str(error)))
        self._lost(error)

    def _drop(self) -> None:
        connection, self._socket = self._socket, None
        if connection is not None:
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()


def _program() -> str:
    """Return a name for this client: its program and its process."""
    name = Path(sys.argv[0] if sys.argv and sys.argv[0] else "python").name
    return f"{name[: m.NAME_MAX - 12]}[{os.getpid()}]"
