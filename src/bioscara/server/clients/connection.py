"""One client on the socket: its messages in, answers, samples, records and events out."""

from __future__ import annotations

import asyncio
import itertools
import logging
import select
from collections import OrderedDict, deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

import msgspec

from bioscara.api import framing, messages as m
from bioscara.api.failures import failure_of
from bioscara.errors import (
    BioscaraError,
    BusyOwnerError,
    InvalidArgumentError,
    OwnerError,
    ProtocolError,
)
from bioscara.printing import printable
from bioscara.server.clients.arm_service import ArmService
from bioscara.server.clients.client import Encoded
from bioscara.server.clients.crowd import Crowd, Share
from bioscara.server.clients.peer import Peer

RETURN = 0.3
"""Time in which a client that may return has to connect again [s]."""
HELLO_TIMEOUT = 5.0
"""Time in which a client has to introduce itself [s]."""
PENDING = 64
"""Number of requests of one connection in work above which slow ones are refused."""
_MOST = 256
"""Number of those above which no more are read."""
WAITING = 8 << 20
"""Answers that wait for a client to read them, above which it is cut off [byte]."""
_RECORDS = 256 << 10
"""Waiting bytes above which records of cycles are left out [byte]."""
_WORK_BYTES, _ALL_WORK_BYTES = 1 << 20, 32 << 20
"""Length of the requests in work of one connection, and of all, above which no more are read of one
that has some [byte]."""
_ALL_WAITING = 64 << 20
"""Answers that wait for all clients, above which the one for which most wait is cut off [byte]."""
ANSWERS, ANSWER_BYTES = 256, 256 << 10
"""Number and length of the answers that are kept for each session [byte]."""
SESSIONS = 256
"""Number of sessions that are kept; those with a connection always are."""
DEAF = 5.0
"""Time in which a client has to take some of what waits for it, else it is cut off [s]; one that
was suspended connects again."""
_EVENTS = 50
"""Events that are sent in a row, before other clients have a turn."""

AnySample = m.StateSample | m.ControllersSample | m.WorldSample
"""The kinds of subscription."""

Answer = m.Response | m.RequestFailed

_log = logging.getLogger(__name__)
_numbers = itertools.count(1)


@dataclass(slots=True)
class ClientSession:
    """A client across its connections.

    Attributes:
        name: Its random name.
        answers: The latest answers, by the numbers of their requests; None while in work.
        size: Length of these answers [byte].
        waiting: Connections that wait for an answer, by the number of its request.
        forgotten: Highest number of a request whose answer is not kept any more.
        connections: Its open connections, the newest last.
        peer: The process that has made the newest; None before the first.
        leaving: Ends a client that has left, unless it returns before; None before it leaves.
    """

    name: str
    answers: OrderedDict[int, Answer | None] = field(default_factory=OrderedDict)
    size: int = 0
    waiting: dict[int, list[Callable[[Answer], None]]] = field(default_factory=dict)
    forgotten: int = 0
    connections: list[Connection] = field(default_factory=list)
    peer: Peer | None = None
    leaving: asyncio.TimerHandle | None = None

    def connect(self, connection: Connection, peer: Peer, changed: Callable[[], object]) -> None:
        """Add a connection, which this process has made.

        Args:
            connection: The connection.
            peer: The process.
            changed: Called when the process has ended.
        """
        self.close()
        self.connections.append(connection)
        self.peer = peer
        peer.watch(changed)

    def leave(self, ended: Callable[[], object]) -> None:
        """Call a function unless there is a connection again in time."""
        if all(connection.has_left for connection in self.connections):
            self.stay()
            self.leaving = asyncio.get_running_loop().call_later(RETURN, ended)

    def stay(self) -> None:
        """Forget that the client leaves."""
        if self.leaving is not None:
            self.leaving.cancel()

    def close(self) -> None:
        """Forget the process, and that the client leaves."""
        self.stay()
        if self.peer is not None:
            self.peer.close()

    @property
    def gone(self) -> bool:
        """Whether its process has ended, and no copy of a connection is open in another one."""
        if self.peer is None or not self.peer.ended:
            return False
        return all(connection.hung_up for connection in self.connections)

    def answer(self, number: int, message: Answer) -> None:
        """Keep an answer, and give it to those that wait for it."""
        self.answers[number] = message
        self.size += _size(message)
        while len(self.answers) > ANSWERS or self.size > ANSWER_BYTES:
            oldest, dropped = next(iter(self.answers.items()))
            if dropped is None or oldest == number:
                break
            del self.answers[oldest]
            self.size -= _size(dropped)
            self.forgotten = max(self.forgotten, oldest)
        for waiting in self.waiting.pop(number, ()):
            waiting(message)


def _size(answer: Answer) -> int:
    try:
        return len(framing.encode_packed(answer))
    except Exception:  # noqa: BLE001  reported where it is sent
        return 0


@dataclass(slots=True)
class _Subscription:
    """Samples of one kind for one client.

    Attributes:
        period: Least time between two of them [s].
        due: Time from which on the next one is sent, on the arm's clock [s].
        behind: Whether one was left out, as the client still read.
        ahead: Number that are sent before the client confirms one; 0 for no limit.
        sent: Cycle of the last one that was sent.
        unconfirmed: Cycles of the samples that it has not confirmed.
    """

    period: float
    due: float = 0.0
    behind: bool = False
    ahead: int = 0
    sent: int = 0
    unconfirmed: deque[int] = field(default_factory=deque)

    @property
    def full(self) -> bool:
        """Whether the client has to confirm one before the next is sent."""
        return 0 < self.ahead <= len(self.unconfirmed)

    def send(self, cycle: int) -> None:
        """Take it that the sample of a cycle is sent."""
        self.sent = cycle
        if self.ahead:
            self.unconfirmed.append(cycle)

    def confirm(self, cycle: int) -> None:
        """Take it that the client has the samples up to a cycle."""
        while self.unconfirmed and self.unconfirmed[0] <= cycle:
            self.unconfirmed.popleft()


class Sessions:
    """The latest sessions, by name.

    Args:
        service: Gets how each is connected.
    """

    def __init__(self, service: ArmService) -> None:
        self._service = service
        self._kept: OrderedDict[str, ClientSession] = OrderedDict()

    def take(self, name: str) -> tuple[ClientSession, bool]:
        """Return the session of a name, and whether it was known."""
        known = name in self._kept
        session = self._kept.setdefault(name, ClientSession(name))
        self._kept.move_to_end(name)
        for oldest in list(self._kept.values()):
            if len(self._kept) <= SESSIONS:
                break
            if oldest is not session and not oldest.connections:
                oldest.close()
                del self._kept[oldest.name]
                self.tell(oldest, forgotten=True)
        return session, known

    def tell(self, session: ClientSession, *, forgotten: bool = False) -> None:
        """Send the arm how a session is connected."""
        self._service.state_of(
            session.name,
            connected=bool(session.connections),
            gone=session.gone,
            forgotten=forgotten,
        )

    def newest_connection(self, name: str) -> Connection | None:
        """Return the newest connection of a session; None if it has none."""
        session = self._kept.get(name)
        return session.connections[-1] if session is not None and session.connections else None

    def close(self) -> None:
        """Forget the processes of all sessions."""
        for session in self._kept.values():
            session.close()


class Connection(asyncio.Protocol):
    """A connection of a client, as a protocol of asyncio.

    Args:
        owner: Carries out the requests.
        sessions: The sessions.
        instance: Random name of this run of the owner.
        crowd: All connections; this one adds and removes itself.
        peer: The process at the other end.
        only_stop: Whether it may only send STOP, as all usual places are taken.

    Attributes:
        session: Name of its session.
        name: Name of the client.
        peer: As given.
        only_stop: As given.
        has_left: Whether its client has left, as far as this connection is concerned.
        number: Its number; newer connections have higher ones.
    """

    def __init__(
        self,
        owner: ArmService,
        sessions: Sessions,
        instance: str,
        crowd: Crowd,
        peer: Peer,
        *,
        only_stop: bool = False,
    ) -> None:
        self.peer, self.only_stop, self.number = peer, only_stop, next(_numbers)
        self._owner, self._sessions, self._instance = owner, sessions, instance
        self._crowd, self._share = crowd, Share(crowd)
        self._frames = framing.MessageSplitter(framing.HELLO_MAX)
        self._decode: Callable[[bytes], Any] = framing.from_client.decode
        self._encode: Callable[[Any], bytes] = framing.encode_packed
        self._transport: asyncio.Transport | None = None
        self._session: ClientSession | None = None
        self.session, self.name, self.has_left = "", "", False
        self._finishing: set[asyncio.Task[None]] = set()
        self._kept: set[asyncio.Task[None]] = set()
        self._work_bytes = 0
        self._full = self._resting = self._pumping = self._waiting_for_share = False
        self._subscriptions: dict[type[AnySample], _Subscription] = {}
        self._cursor: int | None = None
        self._patience: asyncio.TimerHandle | None = None
        self._written = self._taken = 0

    @property
    def json(self) -> bool:
        """Whether the client speaks JSON, and not msgpack."""
        return self._encode is framing.encode_json

    @property
    def hung_up(self) -> bool:
        """Whether the other end is closed, also if its last bytes were not read yet."""
        if self._transport is None or self._transport.is_closing():
            return True
        polled = select.poll()
        polled.register(self._transport.get_extra_info("socket"), 0)
        return any(event & select.POLLHUP for _, event in polled.poll(0))

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin: the client has to introduce itself soon."""
        assert isinstance(transport, asyncio.Transport)  # noqa: S101  of a stream server
        self._transport = transport
        # Zero: a sample is sent only if the client has read everything before it.
        transport.set_write_buffer_limits(high=0)
        self._crowd.connections.add(self)
        self._patience = asyncio.get_running_loop().call_later(
            HELLO_TIMEOUT, self.cut_off, "it did not introduce itself"
        )

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002  asyncio's form
        """End: the lease stays until it lapses, as a client that lives may connect again."""
        self._crowd.connections.discard(self)
        self._transport = None
        self._share.end()
        for task in self._finishing:
            # Its questions need no answer any more; a command goes on.
            task.cancel()
        if self._session is None:
            self.peer.close()
        else:
            self._session.connections.remove(self)
            self._sessions.tell(self._session)
        if self._patience is not None:
            self._patience.cancel()
        if self._session is not None and not self._session.connections:
            self._crowd.announce(f"{self.name} has left", self.name)

    def data_received(self, data: bytes) -> None:
        """Take bytes of the client."""
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        self._share.begin()
        try:
            for payload in self._frames.feed(data):
                self._receive(payload)
                if transport.is_closing():
                    return
                self._frames.longest = framing.REQUEST_MAX
                if self._share.used_up or self._is_busy:
                    break
        except ProtocolError as error:
            self._reject(None, error)
        self._rest()

    @property
    def _in_work(self) -> int:
        return len(self._finishing) + len(self._kept)

    @property
    def _is_busy(self) -> bool:
        """Whether so much is in work that no more is read."""
        size, crowded = self._work_bytes, self._crowd.work_bytes > _ALL_WORK_BYTES
        return self._in_work >= _MOST or size > _WORK_BYTES or (size > 0 and crowded)

    def _rest(self) -> None:
        """Read on once the client has a share of this process again, and waits for less."""
        transport = self._transport
        wait = self._share.rest()
        if transport is None or transport.is_closing() or self._resting:
            return
        if wait > 0.0 or self._is_busy:
            self._resting = True
            transport.pause_reading()
            if wait > 0.0:
                self._waiting_for_share = True
                asyncio.get_running_loop().call_later(wait, self._end_rest)

    def _end_rest(self) -> None:
        self._waiting_for_share = False
        self._go_on()

    def _go_on(self) -> None:
        """Take the bytes that have come already, unless others have their turn."""
        if self._waiting_for_share:
            return
        if self._transport is not None and self._resting and not self._is_busy:
            self._resting = False
            self._transport.resume_reading()
            self.data_received(b"")

    def pause_writing(self) -> None:
        """The client does not read as fast as it is sent."""
        self._full, self._taken = True, -1
        self._require_hearing()

    def _require_hearing(self) -> None:
        """Cut the client off if it has taken nothing since the last look, and else look later."""
        transport = self._transport
        if not self._full or transport is None or transport.is_closing():
            return
        taken = self._written - transport.get_write_buffer_size()
        if taken == self._taken:
            self.cut_off(f"it has read nothing for {DEAF:g} s")
            return
        self._taken = taken
        self._patience = asyncio.get_running_loop().call_later(DEAF, self._require_hearing)

    def resume_writing(self) -> None:
        """The client has read everything: send the newest sample."""
        self._full = False
        if self._patience is not None:
            self._patience.cancel()
        self._catch_up()
        self._pump()

    def _catch_up(self) -> None:
        """Send the newest samples in place of those that were left out."""
        newest = {
            m.StateSample: self._owner.sample,
            m.ControllersSample: self._owner.controllers_sample,
            m.WorldSample: self._owner.world_sample,
        }
        for kind, subscription in self._subscriptions.items():
            if not subscription.behind or subscription.full:
                continue
            if (sample := newest[kind]) is not None:
                subscription.behind = False
                if sample.cycle != subscription.sent:
                    subscription.send(sample.cycle)
                    self._send(sample)

    def _confirm(self, cycle: int) -> None:
        for subscription in self._subscriptions.values():
            subscription.confirm(cycle)
        if not self._full:
            self._catch_up()

    def _receive(self, payload: bytes) -> None:
        if self._session is None and payload[:1] == b"{":
            self._decode, self._encode = framing.json_from_client.decode, framing.encode_json
        try:
            message = self._decode(payload)
        except Exception as error:  # noqa: BLE001  values are made, which refuse what they may
            self._reject(self._readable_number(payload), framing.unusable(error))
            return
        if isinstance(message, m.ClientHello):
            self._greet(message)
        elif self._session is None:
            self._reject(None, ProtocolError("a request came before hello"))
        elif isinstance(message, m.Received):
            self._confirm(message.cycle)
        elif isinstance(message, m.Leave):
            self._leave(self._session, message)
        else:
            self._request(self._session, message, len(payload))

    def _leave(self, session: ClientSession, message: m.Leave) -> None:
        def leave() -> None:
            self._owner.state_of(session.name, connected=False, gone=True, forgotten=False)

        self.has_left = True
        if message.may_return:
            session.leave(leave)
        else:
            leave()

    def _readable_number(self, payload: bytes) -> int | None:
        """Return the number of a request that is otherwise wrong; None if it has none."""
        if self._session is None:
            return None
        decode = msgspec.json.decode if payload[:1] == b"{" else msgspec.msgpack.decode
        try:
            message = decode(payload)
        except (msgspec.DecodeError, RecursionError, UnicodeError):
            return None
        number = message.get("id") if isinstance(message, dict) else None
        return number if isinstance(number, int) else None

    def _greet(self, hello: m.ClientHello) -> None:
        owner = self._owner
        if self._session is not None:
            self._reject(None, ProtocolError("hello came twice"))
            return
        if hello.version != m.VERSION:
            text = f"the owner speaks version {m.VERSION} of its messages, not {hello.version}"
            self._reject(None, ProtocolError(f"{text}; install the same version of bioscara"))
            return
        if not 0 < len(hello.client) <= m.NAME_MAX or not 0 < len(hello.session) <= m.NAME_MAX:
            text = f"a client and its session have names of 1 to {m.NAME_MAX} characters"
            self._reject(None, ProtocolError(text))
            return
        if self._patience is not None:
            self._patience.cancel()
        self.session, self.name = hello.session, printable(hello.client)
        self._session, resumed = self._sessions.take(hello.session)
        session = self._session
        session.connect(self, self.peer, lambda: self._sessions.tell(session))
        self._sessions.tell(session)
        welcome = m.Welcome(
            version=m.VERSION,
            owner=owner.name,
            instance=self._instance,
            arm=owner.description,
            last_event=owner.events.last,
            resumed=resumed,
        )
        self._send(welcome)
        if len(session.connections) == 1:
            self._crowd.announce(f"{self.name} has connected", self.name)

    def _request(self, session: ClientSession, request: m.ClientRequest, size: int) -> None:
        number, command = request.id, request.command
        match command:
            case m.Recall():
                self._recall(session, number, command.request)
                return
            case m.Subscribe():
                self._subscribe(number, command)
                return
        # Of a page two connections number their requests, and the second one only renews.
        keep = not isinstance(command, m.Query | m.RenewLease)
        if keep:
            if number in session.answers or number <= session.forgotten:
                self._recall(session, number, number)
                return
            session.answers[number] = None
        answer = self._answerer(session, number, keep=keep)
        try:
            if self.only_stop and not isinstance(command, m.StopAll):
                raise self._crowd.full()
            if command.slow and self._in_work >= PENDING:
                text = f"{PENDING} requests of this client are in work; wait for their answers"
                raise BusyOwnerError(text)
            result = self._owner.handle(self, command, request.epoch, len(self._crowd.connections))
        except Exception as error:  # noqa: BLE001  answered to the client
            answer(self._refusal(number, error))
            return
        if isinstance(result, Awaitable):
            task = asyncio.get_running_loop().create_task(self._finish(number, result, answer))
            # A command goes on without its client, and keeps its answer.
            finishing = self._kept if keep else self._finishing
            finishing.add(task)
            self._add_work(size)
            task.add_done_callback(finishing.discard)
            task.add_done_callback(lambda _: self._add_work(-size))
            task.add_done_callback(lambda _: self._go_on())
        else:
            answer(m.Response(number, result))

    def _add_work(self, size: int) -> None:
        self._work_bytes += size
        self._crowd.work_bytes += size

    async def _finish(
        self,
        number: int,
        result: Awaitable[m.AnyResult | Encoded],
        answer: Callable[[Answer], None],
    ) -> None:
        try:
            done = await result
        except asyncio.CancelledError:
            raise
        except Exception as error:  # noqa: BLE001  answered to the client
            answer(self._refusal(number, error))
            return
        if isinstance(done, Encoded):
            # Encoded elsewhere; its type is not checked again.
            answer(m.Response(number, msgspec.Raw(done.data)))  # type: ignore[arg-type]
        else:
            answer(m.Response(number, done))

    def _answerer(
        self, session: ClientSession, number: int, *, keep: bool
    ) -> Callable[[Answer], None]:
        def answer(message: Answer) -> None:
            if keep:
                session.answer(number, message)
            self._send(message)

        return answer

    def _recall(self, session: ClientSession, number: int, wanted: int) -> None:
        if wanted not in session.answers:
            if wanted > session.forgotten:
                self._send(m.Response(number, m.NotArrived()))
                return
            error = OwnerError(
                f"request {wanted} was long ago: whether it was carried out is not known any more"
            )
            self._send(m.RequestFailed(number, failure_of(error)))
            return
        kept = session.answers[wanted]
        if kept is not None:
            self._send(msgspec.structs.replace(kept, id=number))
            return
        waiting = session.waiting.setdefault(wanted, [])
        if len(waiting) >= PENDING:
            busy = BusyOwnerError(f"{PENDING} others wait for the answer to request {wanted}")
            self._send(m.RequestFailed(number, failure_of(busy)))
            return
        waiting.append(lambda message: self._send(msgspec.structs.replace(message, id=number)))

    def _refusal(self, number: int, error: Exception) -> m.RequestFailed:
        if not isinstance(error, BioscaraError | OSError):
            _log.error("request %d of %s failed", number, self.name, exc_info=error)
        return m.RequestFailed(number, failure_of(error))

    def _reject(self, number: int | None, error: BioscaraError) -> None:
        """Refuse a message that cannot be read; without its number the connection ends."""
        self._send(m.RequestFailed(number, failure_of(error)))
        if number is None:
            _log.warning("client %s is cut off: %s", self.name or "without a name", error)
            if self._transport is not None:
                self._transport.close()

    def cut_off(self, reason: str) -> None:
        """End the connection at once.

        Args:
            reason: Why, for the log.
        """
        _log.warning("client %s is cut off: %s", self.name or "without a name", reason)
        if self._transport is not None:
            self._transport.abort()

    def _subscribe(self, number: int, command: m.Subscribe) -> None:
        for period in (command.period, command.controllers_period, command.world_period):
            if not period >= 0.0:
                error = InvalidArgumentError(f"period {period:g} s must not be below zero")
                self._send(m.RequestFailed(number, failure_of(error)))
                return
        if command.unconfirmed < 0:
            error = InvalidArgumentError(
                f"unconfirmed {command.unconfirmed} must not be below zero"
            )
            self._send(m.RequestFailed(number, failure_of(error)))
            return
        self._send(m.Response(number, m.Done()))
        self._subscriptions = {}
        if command.states:
            self._subscriptions[m.StateSample] = _Subscription(
                command.period, ahead=command.unconfirmed
            )
        if command.controllers:
            self._subscriptions[m.ControllersSample] = _Subscription(command.controllers_period)
        if command.world:
            self._subscriptions[m.WorldSample] = _Subscription(
                command.world_period, ahead=command.unconfirmed
            )
        self._cursor = command.events_after
        asyncio.get_running_loop().call_soon(self._pump)

    @property
    def ending(self) -> bool:
        """Whether it has ended, or is being closed."""
        return self._transport is None or self._transport.is_closing()

    def wants(self, kind: type[AnySample]) -> bool:
        """Return whether it has subscribed to samples of a kind."""
        return kind in self._subscriptions

    def hang_up(self) -> None:
        """End the connection once everything is sent."""
        if self._transport is not None:
            self._transport.close()

    def offer(self, kind: type[AnySample], sample: framing.Framed, time: float, cycle: int) -> None:
        """Send a sample, unless the client still reads; then it gets the newest afterwards.

        Args:
            kind: Its kind, to which the client has subscribed.
            sample: The sample.
            time: Its time on the arm's clock [s].
            cycle: Number of its cycle.
        """
        subscription = self._subscriptions[kind]
        # The client may have got it already, after it had read the samples before.
        if self.ending or time < subscription.due or cycle == subscription.sent:
            return
        subscription.due = time + 0.999 * subscription.period
        if self._full or subscription.full:
            subscription.behind = True
        else:
            subscription.send(cycle)
            self._write(sample.json if self.json else sample.packed)

    def pump(self) -> None:
        """Send the events that are due."""
        if self._cursor is not None:
            self._pump()

    def _pump(self) -> None:
        for _ in range(_EVENTS):
            if self._cursor is None or self._full or self.ending:
                return
            event = self._owner.events.after(self._cursor)
            if event is None:
                return
            self._cursor = event.number
            framed = self._owner.events.framed(event)
            self._write(framed.json if self.json else framed.packed)
        if not self._pumping:
            self._pumping = True
            asyncio.get_running_loop().call_soon(self._pump_on)

    def _pump_on(self) -> None:
        self._pumping = False
        self._pump()

    def offer_record(self, cycle: m.GoalCycle) -> None:
        """Send a record of a cycle, unless the client reads too slowly."""
        if self._transport is not None and self._transport.get_write_buffer_size() < _RECORDS:
            self._send(cycle)

    def _send(self, message: m.ApiMessage) -> None:
        try:
            data = self._encode(message)
        except Exception as error:  # noqa: BLE001  one answer, not the connection
            _log.error("%s cannot be sent", type(message).__name__, exc_info=error)
            if not isinstance(message, m.Response | m.RequestFailed):
                return
            failure = failure_of(OwnerError(f"the answer cannot be sent: {error}"))
            data = self._encode(m.RequestFailed(message.id, failure))
        self._write(framing.framed(data))

    def _write(self, data: bytes) -> None:
        # A transport that is closing takes no bytes, and its end has not been called yet.
        transport = self._transport
        if transport is None or transport.is_closing():
            return
        if transport.get_write_buffer_size() > WAITING:
            self.cut_off("it does not read its answers")
            return
        self._written += len(data)
        transport.write(data)
        if self.waiting > _ALL_WAITING // 64:
            self._crowd.limit_waiting(_ALL_WAITING)

    @property
    def waiting(self) -> int:
        """Length of the answers that wait for the client [byte]."""
        return 0 if self._transport is None else self._transport.get_write_buffer_size()
