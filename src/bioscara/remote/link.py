"""The connection of a program to an owner: requests, answers, events and records."""

from __future__ import annotations

import itertools
import logging
import math
import os
import secrets
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import msgspec

from bioscara.api import framing, messages as m
from bioscara.api.direct_stop import USUAL
from bioscara.api.failures import error_of
from bioscara.arguments import number
from bioscara.errors import (
    AccessError,
    BioscaraError,
    BusyError,
    InvalidArgumentError,
    OwnerError,
    OwnerLostError,
    ProtocolError,
)
from bioscara.printing import printable
from bioscara.processes.forking import Maker, in_child
from bioscara.remote.owner_socket import OwnerSocket
from bioscara.remote.transport import Transport, TransportConnection

PATIENCE = 5.0
"""Time for which a broken connection is tried again before requests fail [s]."""
_ANSWER_TIMEOUT = 60.0
"""Longest time to wait for an answer [s]: planning takes a second at most."""
_LOOK = 0.25
"""Period in which a wait looks for the silence of the owner [s]."""
_TRIES = 5
"""How often a request is sent whose connection breaks each time: it may be the cause."""

_log = logging.getLogger(__name__)


class _Pending:
    """A request whose answer has not come."""

    __slots__ = ("admit", "answer", "arrived", "come", "data", "request", "tries")

    def __init__(
        self,
        request: m.ClientRequest,
        encoded: Callable[[object], bytes],
        arrived: Callable[[m.AnyResult], object] | None,
        admit: Callable[[], object],
    ) -> None:
        self.request, self.arrived, self.admit = request, arrived, admit
        try:
            self.data = encoded(request)
        except (TypeError, ValueError, OverflowError, RecursionError) as error:
            raise InvalidArgumentError(
                f"a value cannot be sent to the owner: {printable(str(error))}"
            ) from error
        except Exception as error:
            raise InvalidArgumentError(
                f"a value cannot be sent to the owner: {type(error).__name__}"
            ) from error
        if len(self.data) > framing.REQUEST_MAX:
            raise InvalidArgumentError(
                f"the request has {len(self.data)} bytes, and an owner takes at most "
                f"{framing.REQUEST_MAX}; divide it"
            )
        self.come = threading.Event()
        self.answer: m.AnyResult | Exception | None = None
        self.tries = 1

    def admitted(self) -> bool:
        """Return whether it may be sent; if not, it fails with the reason."""
        try:
            self.admit()
        except BioscaraError as error:
            self.settle(error)
            return False
        return True

    def settle(self, answer: m.AnyResult | Exception) -> None:
        if self.arrived is not None and not isinstance(answer, Exception):
            try:
                self.arrived(answer)
            except Exception as error:  # noqa: BLE001  raised by the request
                answer = error
        self.answer = answer
        self.come.set()


class OwnerLink:
    """A connection to the owner of an arm, made again when it breaks.

    A request whose answer was missed is never carried out twice: after connecting again its answer
    is recalled, and it is sent again only if it had not arrived. Used by any thread.

    Once samples are subscribed to, requests fail when nothing has come from the owner for a time.
    Until it is heard again, requests that need the lease are not sent: they would be carried out
    late.

    Args:
        owner: Name of the owner, or the way to it.
        receive: Called in the link's thread with each event, sample and record; must return at
            once.
        lost: Called there when the owner has ended or was restarted, and its goals with it.
        events_after: Number after which events are received; None for new ones only.
        client: Name of this client, for messages to people; None for its program and process.

    Attributes:
        name: Name of the owner or its address, for messages to people.
        welcome: The owner's greeting at the last connection.
        maker: The process that has connected; in a forked child requests are refused.

    Raises:
        InvalidArgumentError: No arm can have that name.
    """

    def __init__(
        self,
        owner: str | Transport,
        receive: Callable[[m.FromOwner], object],
        lost: Callable[[OwnerLostError], object],
        *,
        events_after: int | None = None,
        client: str | None = None,
    ) -> None:
        self._transport = OwnerSocket(owner) if isinstance(owner, str) else owner
        self.name = self._transport.name
        self._heard = time.monotonic()
        self._receive, self._lost = receive, lost
        self._session = secrets.token_hex(16)
        self._client = _program() if client is None else client[: m.NAME_MAX]
        self._numbers = itertools.count(1)
        self._pending: dict[int, _Pending] = {}
        self._recalls: dict[int, int] = {}
        self._lock, self._sending = threading.Lock(), threading.Lock()
        # Held while the connection is given up or made again after that.
        self._opening = threading.RLock()
        self._connection: TransportConnection | None = None
        self._subscription = m.Subscribe(events_after=0)
        self._events_after, self._last_event = events_after, 0
        self._closed = False
        self.maker = Maker(f"the connection to arm {self.name}", "connect() in this one, too")
        self._failure: OwnerLostError | None = None
        self._reproach: Exception | None = None
        self.welcome: m.Welcome
        self._reader: threading.Thread | None = None
        in_child(self._leave_to_parent)

    def _leave_to_parent(self) -> None:
        """Leave the connection to the parent of this process, which was forked from it."""
        self._closed = True
        # Not shut down, which would end the connection of the parent.
        if self._connection is not None:
            self._connection.close()
        self._connection = self._reader = None
        # Each may have been held by a thread that this process does not have.
        self._lock, self._sending = threading.Lock(), threading.Lock()
        self._opening = threading.RLock()

    def open(self) -> None:
        """Connect.

        Raises:
            OwnerLostError: No owner of that name runs, or it does not answer.
            ProtocolError: It speaks another version.
        """
        waiting = self._connect()
        newest = self.welcome.last_event
        self._last_event = newest if self._events_after is None else self._events_after
        self._subscribe()
        self._start_reading(waiting)

    def _start_reading(self, waiting: list[m.FromOwner]) -> None:
        self._reader = threading.Thread(
            target=self._read,
            args=(waiting,),
            name=f"bioscara-link-{self.name}",
            daemon=True,
        )
        self._reader.start()

    def close(self) -> None:
        """Disconnect; may be called again."""
        with self._lock:
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
        self._subscription = msgspec.structs.replace(
            self._subscription, states=states, period=period
        )
        self._subscribe()

    def subscribe_to_controllers(self, period: float = 0.0) -> None:
        """Let the owner send samples of the clients' controllers.

        Args:
            period: Least time between two of them [s].

        Raises:
            InvalidArgumentError: The period is below zero or not finite.
        """
        if not (period := number("period", period)) >= 0.0:
            raise InvalidArgumentError(f"period {period:g} s must not be below zero")
        self._subscription = msgspec.structs.replace(
            self._subscription, controllers=True, controllers_period=period
        )
        self._subscribe()

    def subscribe_to_world(self) -> None:
        """Let the owner send samples of the bodies around a simulated arm."""
        self._subscription = msgspec.structs.replace(self._subscription, world=True)
        self._subscribe()

    def _subscribe(self) -> None:
        command = msgspec.structs.replace(self._subscription, events_after=self._last_event)
        request = m.ClientRequest(id=next(self._numbers), command=command)
        self._write(self._transport.encoded(request))

    def request(
        self,
        command: m.AnyCommand,
        epoch: int | None = None,
        *,
        arrived: Callable[[m.AnyResult], object] | None = None,
        admit: Callable[[], object] = lambda: None,
        timeout: float | None = None,
    ) -> m.AnyResult:
        """Send a request and return its result.

        Args:
            command: The request.
            epoch: Epoch of the lease, for commands that need one.
            arrived: Called with the result when it comes, also if this call was interrupted before,
                as by Ctrl-C; in the thread of the connection, so that it must not make requests.
                An interrupted call waits for it, unless that is interrupted too.
            admit: Called before it is sent, after all that is sent before it, and raises a
                BioscaraError to refuse it; likewise in the thread of the connection if it is sent
                again.
            timeout: Longest time to wait for the answer [s]; None for a minute.

        Raises:
            InvalidArgumentError: A value cannot be sent.
            OwnerLostError: The owner does not run or does not answer.
            BusyError: Called in a callback of the connection, which would wait for itself.
            BioscaraError: The error of the owner.
        """
        if threading.current_thread() is self._reader:
            kind = type(command).__name__
            raise BusyError(kind, "a callback of the connection", 0.0, "", inside=True)
        if epoch is not None:
            self.require()
            self.require_heard()
        timeout = _ANSWER_TIMEOUT if timeout is None else timeout
        request = m.ClientRequest(id=next(self._numbers), command=command, epoch=epoch)
        pending = _Pending(request, self._transport.encoded, arrived, admit)
        self._register(pending)
        try:
            urgent = isinstance(command, m.StopAll)
            self._write(pending.data, urgent=urgent, wanted=pending.admitted)
            come = self._wait(pending, timeout)
        except BaseException:
            # Without a callback the answer is of no use any more.
            if arrived is None or pending.come.wait(PATIENCE):
                self._forget(pending)
            raise
        self._forget(pending)
        if not come:
            self.require_heard()
            raise OwnerLostError(
                f"the owner of arm {self.name} has not answered within {timeout:g} s"
            )
        answer = pending.answer
        if isinstance(answer, Exception):
            raise answer
        if answer is None:
            raise OwnerLostError(f"the owner of arm {self.name} gave no answer")
        return answer

    def _wait(self, pending: _Pending, timeout: float) -> bool:
        """Wait for an answer, no longer than the owner may be silent; return whether it came."""
        begin = now = time.monotonic()
        end = begin + timeout
        while now < end:
            limit = min(end, max(begin, self._heard) + self._silence())
            if now >= limit:
                return False
            if pending.come.wait(min(limit - now, _LOOK)):
                return True
            before, now = now, time.monotonic()
            if now - before > 2.0 * _LOOK:
                # This program did not run, and may not have read all messages.
                begin = now
        return False

    def stop(self) -> None:
        """Stop all motion, also where the process that answers clients hangs.

        Raises:
            BioscaraError: The owner does not run, or did not confirm it.
        """
        if (directly := self._transport.direct_stop) is None:
            self.request(m.StopAll())
            return
        try:
            if self._failure is None:
                self.request(m.StopAll(), timeout=USUAL)
                return
        except OwnerLostError:
            pass
        directly(self._client, self._session)

    def _silence(self, *, reconnecting: bool = True) -> float:
        """How long the owner may be silent [s]; it always is without a subscription to samples."""
        if not (self._subscription.states or self._subscription.controllers):
            return math.inf
        if reconnecting and self._connection is None:
            return math.inf
        return self._transport.silence

    def require_heard(self, *, reconnecting: bool = True) -> None:
        """Raise if the owner is silent for longer than it may be.

        Args:
            reconnecting: Whether it may be, while its connection is made again.

        Raises:
            OwnerLostError: It is.
        """
        silent = time.monotonic() - self._heard
        if silent >= self._silence(reconnecting=reconnecting):
            raise OwnerLostError(
                f"the owner of arm {self.name} has been silent for {silent:.1f} s: it has ended, "
                "was stopped, or its computer is overloaded"
            )

    def require(self) -> None:
        """Connect again if the owner was lost.

        Raises:
            OwnerLostError: It does not run or does not answer, or the connection was closed.
        """
        self._register(None)

    def _register(self, pending: _Pending | None) -> None:
        """Expect the answer to a request, on a connection that is made again if it was lost."""
        self.maker.require()
        while True:
            with self._lock:
                if self._closed:
                    raise OwnerLostError(f"the connection to arm {self.name} was closed")
                if self._failure is None:
                    if pending is not None:
                        self._pending[pending.request.id] = pending
                    return
            with self._opening:
                if self._failure is not None and not self._closed:
                    self._reopen()

    def _forget(self, pending: _Pending) -> None:
        with self._lock:
            self._pending.pop(pending.request.id, None)

    def _reopen(self) -> None:
        waiting = self._connect()
        self._last_event = self.welcome.last_event
        with self._lock:
            self._failure = None
        self._subscribe()
        self._start_reading(waiting)

    def _connect(self) -> list[m.FromOwner]:
        """Connect and be greeted; return the messages that came with the greeting."""
        connection: TransportConnection | None = None
        try:
            connection = self._transport.connect(PATIENCE)
            hello = m.ClientHello(version=m.VERSION, client=self._client, session=self._session)
            # An owner that refuses this client says why, and may not read this.
            with suppress(BrokenPipeError, ConnectionResetError):
                connection.send(self._transport.encoded(hello))
            greeting, *messages = connection.receive()
            if isinstance(greeting, m.RequestFailed):
                raise error_of(greeting.failure)
            if not isinstance(greeting, m.Welcome):
                raise ProtocolError(f"the owner of arm {self.name} does not greet")
            connection.greeted()
        except BaseException as error:
            if connection is not None:
                connection.close()
            if isinstance(error, OSError | msgspec.DecodeError):
                raise OwnerLostError(
                    f"the owner of arm {self.name} cannot be reached: {error}"
                ) from error
            raise
        self._connection, self.welcome = connection, greeting
        self._heard = time.monotonic()
        return messages

    def _write(
        self, data: bytes, *, urgent: bool = False, wanted: Callable[[], bool] = lambda: True
    ) -> None:
        """Send a message, unless it is not wanted then; an urgent one does not wait for others."""
        connection = self._connection
        if connection is None:
            return
        if not urgent:
            connection.wait_turn(len(data))
        if not self._sending.acquire(timeout=USUAL if urgent else -1.0):
            # The owner does not take the message of another thread.
            return
        try:
            # On a new connection its answer is asked for.
            if connection is not self._connection or not wanted():
                return
            try:
                connection.send(data)
            except BaseException as error:
                # A part may have been sent, which nothing may follow. The reader notices this,
                # connects again and asks for the answers that were missed.
                with suppress(OSError):
                    connection.end()
                if not isinstance(error, OSError):
                    raise
        finally:
            self._sending.release()

    def _read(self, waiting: list[m.FromOwner]) -> None:
        while not self._closed:
            for message in waiting:
                self._take(message)
            try:
                connection = self._connection
                if connection is not None:
                    waiting = connection.receive()
                    self._heard = time.monotonic()
                    continue
            except AccessError as error:
                self._fail(OwnerLostError(str(error)))
                return
            except (OSError, msgspec.DecodeError, OwnerError):
                pass
            if self._closed:
                break
            try:
                waiting = self._resume()
            except BioscaraError as error:
                self._fail(OwnerLostError(str(error)))
                return
        self._drop()

    def _resume(self) -> list[m.FromOwner]:
        """Connect again, and ask for the answers that were missed.

        Raises:
            OwnerLostError: The owner has ended, or was restarted.
        """
        instance, end = self.welcome.instance, time.monotonic() + PATIENCE
        self._drop()
        while True:
            try:
                waiting = self._connect()
                break
            except OwnerError as error:
                if self._transport.ended():
                    raise OwnerLostError(
                        f"the owner of arm {self.name} has ended: the arm has stopped, and what "
                        "it did is over"
                    ) from error
                final = self._closed or time.monotonic() >= end
                if final or isinstance(error, AccessError):
                    raise
                time.sleep(self._transport.pause)
        if self.welcome.instance != instance:
            self._drop()
            raise OwnerLostError(
                f"the owner of arm {self.name} was restarted: the arm has stopped, and what it did "
                "is over"
            )
        self._subscribe()
        self._recalls.clear()
        with self._lock:
            missed = list(self._pending.values())
        for pending in missed:
            if not self.welcome.resumed and not isinstance(pending.request.command, m.Query):
                pending.settle(
                    OwnerLostError(
                        f"the owner of arm {self.name} does not know this program any more: "
                        "whether it carried the request out is unknown"
                    )
                )
                continue
            number = next(self._numbers)
            self._recalls[number] = pending.request.id
            recall = m.ClientRequest(id=number, command=m.Recall(request=pending.request.id))
            self._write(self._transport.encoded(recall))
        return waiting

    def _take(self, message: m.FromOwner) -> None:
        if isinstance(message, m.Response | m.RequestFailed):
            self._settle(message)
            return
        if isinstance(message, m.Event):
            self._last_event = message.number
        try:
            self._receive(message)
        except Exception as error:  # noqa: BLE001  of a callback: the connection goes on
            _log.error("a callback of arm %s has failed", self.name, exc_info=error)

    def _settle(self, message: m.Response | m.RequestFailed) -> None:
        if message.id is None:
            if isinstance(message, m.RequestFailed):
                self._reproach = error_of(message.failure)
            return
        recalled = self._recalls.pop(message.id, None)
        with self._lock:
            pending = self._pending.get(message.id if recalled is None else recalled)
        if pending is None:
            return
        if isinstance(message, m.RequestFailed):
            pending.settle(error_of(message.failure))
        elif isinstance(message.result, m.NotArrived) and recalled is not None:
            self._send_again(pending)
        else:
            pending.settle(message.result)

    def _send_again(self, pending: _Pending) -> None:
        if pending.tries >= _TRIES:
            reason = "" if self._reproach is None else f": {self._reproach}"
            pending.settle(
                OwnerLostError(
                    f"the connection to the owner of arm {self.name} has broken at this request "
                    f"{_TRIES} times{reason}"
                )
            )
            return
        pending.tries += 1
        self._write(pending.data, wanted=pending.admitted)

    def _fail(self, error: OwnerLostError) -> None:
        with self._opening:
            self._drop()
            with self._lock:
                self._failure = error
                missed = list(self._pending.values())
            # First: a caller whose request fails finds the loss noted.
            try:
                self._lost(error)
            except Exception as failed:  # noqa: BLE001  of a callback
                _log.error("a callback of arm %s has failed", self.name, exc_info=failed)
            for pending in missed:
                pending.settle(OwnerLostError(str(error)))

    def _drop(self) -> None:
        connection, self._connection = self._connection, None
        if connection is not None:
            with suppress(OSError):
                connection.end()
            # Another thread may be sending, which this has ended.
            with self._sending:
                connection.close()


def _program() -> str:
    """Return a name for this client: its program and its process."""
    path = Path(sys.argv[0] if sys.argv and sys.argv[0] else "python")
    # Of a package that is run with -m.
    name = path.parent.name if path.name == "__main__.py" else path.name
    return f"{printable(name)[: m.NAME_MAX - 12]}[{os.getpid()}]"
