"""The process of the clients, as the process that moves the arm sees it."""

from __future__ import annotations

import asyncio
import logging
import os
import pickle
import signal
import socket
import threading
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from bioscara.api import framing, messages as m
from bioscara.api.failures import failure_of
from bioscara.api.runtime import OwnerClaim
from bioscara.errors import BioscaraError, ConfigurationError, NotInitializedError
from bioscara.planning import Trajectory
from bioscara.processes import nursery
from bioscara.processes.supervision import Heartbeat, until_lost
from bioscara.report import CycleRecord
from bioscara.robot.workspace.workspace import Workspace
from bioscara.server.channel import channel_messages as c
from bioscara.server.channel.api_process import LISTENER, NURSERY, serve_clients
from bioscara.server.clients.client import Later
from bioscara.server.owner import Owner
from bioscara.server.stop_socket import StopSocket

_WORKERS = 2
"""Threads for commands that take longer, as planning; likewise for queries."""
_TICK = 0.5
"""Period of the check of the socket and the lease [s]."""
_BEGIN = 30.0
"""Time in which the process has to begin [s]: a busy computer imports slowly."""
_PATIENCE = 5.0
"""Time in which it has to send its last messages [s]."""
_AGAIN = 1.0
"""Least time between two starts of it [s]."""
_RECORDS, _SAMPLES = 1 << 20, 4 << 20
"""Waiting bytes above which records of cycles, and samples, are left out [byte]."""
_BACKLOG = 128
"""Clients that wait to be accepted."""
_EVENTS = 100
"""Events that are sent in a row: a process that begins anew gets all that are kept."""
_LONGEST = 256 << 20
"""Longest message of the channel [byte]: a trajectory of 500,000 points has 52 MB."""

_log = logging.getLogger(__name__)


@dataclass(eq=False, slots=True)
class ChannelClient:
    """A client in the process of the clients; as :class:`Client`."""

    session: str
    name: str
    _channel: _Channel
    connected: bool = True
    gone: bool = False

    def send_record(self, goal: int, record: CycleRecord) -> None:
        """Send the record of a control cycle of its goal, unless too much waits."""
        self._channel.send_record(self.session, m.GoalCycle(goal, record))


class ApiProcess:
    """Runs the process that answers the clients of an owner, in the running event loop.

    Args:
        owner: Carries out the requests.
        claim: The claim to the arm's name.
        evidence: Folder of the flight records.
        group: Number of the group whose members may be clients; None for this user alone.
    """

    def __init__(
        self, owner: Owner, claim: OwnerClaim, evidence: Path, group: int | None = None
    ) -> None:
        self._owner, self._claim, self._evidence, self._group = owner, claim, evidence, group
        self._commands = ThreadPoolExecutor(_WORKERS, "bioscara-command")
        self._queries = ThreadPoolExecutor(_WORKERS, "bioscara-query")
        self._channel: _Channel | None = None
        self._listeners: socket.socket | None = None
        self._tasks: list[asyncio.Task[None]] = []
        self._closing = False

    async def start(self) -> None:
        """Begin, and return when clients are answered.

        Raises:
            ConfigurationError: The process does not begin.
            OSError: It cannot be made.
        """
        self._owner.changed, self._owner.sampled = self._changed, self._sampled
        stops = StopSocket(self._claim, self._group, self._owner.stop_at_once)
        runner = self._owner.robot.runner
        runner.observers = (*runner.observers, stops.look)
        await self._begin()
        loop = asyncio.get_running_loop()
        works = (
            self._tick(),
            nursery.supervise(self._report, self._hand_over_nursery),
            self._supervise(),
        )
        self._tasks = [loop.create_task(each) for each in works]

    async def close(self) -> None:
        """Let the process send what waits, and end it."""
        self._closing = True
        for task in self._tasks:
            task.cancel()
        if self._channel is not None:
            self._channel.pump()
            self._channel.send(c.End())
            with suppress(TimeoutError):
                await asyncio.wait_for(self._channel.ended.wait(), _PATIENCE)
            self._channel.close()
        if self._listeners is not None:
            self._listeners.close()
        for workers in (self._commands, self._queries):
            workers.shutdown(wait=False, cancel_futures=True)

    async def _begin(self) -> None:
        if self._group is not None:
            self._claim.share(self._group)
        ours, theirs = socket.socketpair()
        handing, taking = socket.socketpair()
        with theirs, taking:
            nursery.spawn(serve_clients, sockets=[theirs, taking])
        if self._listeners is not None:
            self._listeners.close()
        self._listeners = handing
        channel = _Channel(self._owner, ours, self._commands, self._queries, self._listen)
        await asyncio.get_running_loop().create_connection(lambda: channel, sock=ours)
        owner = self._owner
        channel.send(
            c.Begin(
                name=owner.name,
                arm=owner.description,
                rate=owner.rate,
                sample=owner.sample,
                evidence=str(self._evidence.absolute()),
                group=self._group,
            )
        )
        self._channel = channel
        channel.pump()
        self._hand_over()
        try:
            await asyncio.wait_for(channel.ready.wait(), _BEGIN)
        except TimeoutError:
            channel.close()
        if channel.ended.is_set() or not channel.ready.is_set():
            raise ConfigurationError(
                f"the process that answers the clients of {owner.name} does not begin; the lines "
                "before this one say why"
            )

    def _listen(self) -> None:
        """Be the process that clients find at the socket, after the other one has listened."""
        self._claim.listener.listen(_BACKLOG)

    def _hand_over(self) -> None:
        """Give the socket on which clients connect to the other process."""
        assert self._listeners is not None  # noqa: S101  it has begun
        socket.send_fds(self._listeners, [LISTENER], [self._claim.listener.fileno()])

    def _hand_over_nursery(self) -> None:
        """Let the other process use the nursery that this one has now."""
        assert self._listeners is not None  # noqa: S101  it has begun
        # One that has ended gets the nursery from which it begins anew.
        with suppress(OSError):
            nursery.hand_over(self._listeners, NURSERY)

    def _report(self, text: str) -> None:
        self._owner.announce("owner", text)

    def _sampled(self) -> None:
        """Send the newest sample, in the thread of the control loop."""
        if (channel := self._channel) is not None:
            channel.send_sample_at_once()

    def _changed(self, has_sample: bool) -> None:
        if (channel := self._channel) is None:
            return
        if has_sample:
            channel.send_sample()
        else:
            channel.pump()

    async def _tick(self) -> None:
        """Let a lease lapse in time, and listen again if the socket was removed."""
        while True:
            await asyncio.sleep(_TICK)
            self._owner.tick()
            try:
                if not self._claim.restore():
                    continue
                if self._group is not None:
                    self._claim.share(self._group)
                self._hand_over()
                text = f"{self._claim.socket} was removed, and made again"
                self._owner.announce("owner", text)
            except Exception as error:  # noqa: BLE001  tried again; the arm goes on
                _log.error("%s cannot be made again: %s", self._claim.socket, error)

    async def _supervise(self) -> None:
        """Begin the process again if it has ended: the arm goes on, and leases have lapsed."""
        loop = asyncio.get_running_loop()
        while True:
            assert self._channel is not None  # noqa: S101  it has begun
            begun = loop.time()
            await self._channel.until_ended(self._report)
            self._report("the process that answers the clients has ended, and is started again")
            await asyncio.sleep(max(begun + _AGAIN - loop.time(), 0.0))
            # One that hangs is replaced first.
            await nursery.until_answered()
            try:
                await self._begin()
            except (BioscaraError, OSError) as error:
                _log.error("%s", error)


class _Channel(asyncio.Protocol):
    """The connection to one run of the process.

    Attributes:
        ready: Set when it answers clients.
        ended: Set when it has ended.
    """

    def __init__(
        self,
        owner: Owner,
        connection: socket.socket,
        commands: Executor,
        queries: Executor,
        listening: Callable[[], object],
    ) -> None:
        self._owner, self._commands, self._queries = owner, commands, queries
        self._connection, self._writing = connection, threading.RLock()
        self._rest, self._sampled = b"", 0
        self._listening = listening
        self.ready, self.ended = asyncio.Event(), asyncio.Event()
        self._heartbeat = Heartbeat(0, lambda: self.send(c.AskAlive()))
        self._loop = asyncio.get_running_loop()
        self._frames = framing.MessageSplitter(_LONGEST)
        self._transport: asyncio.Transport | None = None
        self._clients: dict[str, ChannelClient] = {}
        self._finishing: set[asyncio.Task[None]] = set()
        self._cursor, self._pumping = 0, False
        self._workspace: tuple[Workspace | None, bytes] = None, b""
        self._world: m.WorldSample | None = None
        self._faults: object = None
        self._revision = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        assert isinstance(transport, asyncio.Transport)  # noqa: S101  of a socket
        self._transport = transport

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002  asyncio's form
        """The process has ended: so have all clients that command the arm through it."""
        self._transport = None
        for client in self._clients.values():
            client.connected, client.gone = False, True
        self.ready.set()
        self.ended.set()

    async def until_ended(self, report: Callable[[str], object]) -> None:
        """Return when the process has ended; end it if it hangs.

        Args:
            report: Called with what happens, in words.
        """
        what = "the process that answers the clients"
        ended = self._loop.create_task(self.ended.wait())
        lost = self._loop.create_task(
            until_lost(
                self._heartbeat, lambda: report(f"{what} does not answer, as it gets no processor")
            )
        )
        try:
            await asyncio.wait((ended, lost), return_when=asyncio.FIRST_COMPLETED)
            if lost.done() and lost.result() and not self.ended.is_set():
                report(f"{what} hangs, and is killed")
                # Never 0, which would be this process with all of its group: it has answered.
                with suppress(ProcessLookupError):
                    os.kill(self._heartbeat.pid, signal.SIGKILL)
            await ended
        finally:
            for task in (ended, lost):
                task.cancel()

    def close(self) -> None:
        """End the connection, and with it the process."""
        if self._transport is not None:
            self._transport.abort()

    def data_received(self, data: bytes) -> None:
        """Take messages."""
        for payload in self._frames.feed(data):
            self._receive(c.from_api.decode(payload))

    def _receive(self, message: Any) -> None:
        match message:
            case c.Handle():
                self._handle(message)
            case c.AskPlanningStart():
                self._answer_with(message.id, self._planning_start)
            case c.SessionState():
                self._set_state(message)
            case c.Wanted():
                self._owner.controllers_wanted = message.controllers
                self._owner.world.wanted = message.world
            case c.AddEvent():
                self._owner.announce(message.what, message.text, message.client)
            case c.LogLine():
                logging.getLogger(message.logger).log(message.level, "%s", message.text)
            case c.Alive():
                self._heartbeat.answer()
            case c.Ready():
                self._heartbeat.pid = message.pid
                self._listening()
                self.ready.set()

    def _client(self, session: str, name: str) -> ChannelClient:
        client = self._clients.get(session)
        if client is None:
            client = self._clients[session] = ChannelClient(session, name, self)
        client.name = name or client.name
        return client

    def _set_state(self, state: c.SessionState) -> None:
        client = self._clients.get(state.session)
        if client is None:
            return
        # Of a session that is forgotten nothing more can come.
        client.connected, client.gone = state.connected, state.gone or state.forgotten
        if state.forgotten:
            del self._clients[state.session]
        if client.gone:
            self._owner.expire()

    def _handle(self, request: c.Handle) -> None:
        client = self._client(request.session, request.client)
        trajectory: Trajectory | None = None
        try:
            if request.trajectory:
                trajectory = pickle.loads(request.trajectory)  # noqa: S301  of our process
            result = self._owner.handle(client, request.command, request.epoch, trajectory)
        except Exception as error:  # noqa: BLE001  answered to the client
            self._refuse(request.id, error)
            return
        if not isinstance(result, Later):
            self._answer(request.id, result)
            return
        workers = self._commands if request.command.needs_lease else self._queries
        task = self._loop.create_task(self._finish(request.id, result, workers))
        self._finishing.add(task)
        task.add_done_callback(self._finishing.discard)

    async def _finish(self, number: int, later: Later, workers: Executor) -> None:
        try:
            done = await self._loop.run_in_executor(workers, later.work)
            self._answer(number, later.ended(done))
        except Exception as error:  # noqa: BLE001  answered to the client
            self._refuse(number, error)

    def _answer_with(self, number: int, function: Callable[[], Any]) -> None:
        try:
            self._answer(number, function())
        except Exception as error:  # noqa: BLE001  answered to the client
            self._refuse(number, error)

    def _answer(self, number: int, result: object) -> None:
        self.send(c.Answered(number, msgspec.Raw(framing.encode_packed(result))))

    def _refuse(self, number: int, error: Exception) -> None:
        if not isinstance(error, BioscaraError | OSError):
            _log.error("a request of a client failed", exc_info=error)
        self.send(c.Refused(number, failure_of(error)))

    def _planning_start(self) -> c.PlanningStart:
        workspace, positions = self._owner.planning_start()
        if workspace is not self._workspace[0]:
            self._workspace = workspace, pickle.dumps(workspace)
        return c.PlanningStart(self._workspace[1], positions)

    def send(self, message: c.ChannelMessage) -> None:
        """Send a message."""
        self._write(framing.packed(message))

    def _write(self, data: bytes) -> None:
        with self._writing:
            if self._transport is not None:
                rest, self._rest = self._rest, b""
                self._transport.write(rest + data)

    def send_sample_at_once(self) -> None:
        """Send the newest sample in the thread of the control loop, which never waits.

        It spares the wake-up of the thread of the requests, which sends samples that come with
        changes, or while something waits to be sent.
        """
        owner, world = self._owner, self._owner.world.sample
        if not self._writing.acquire(blocking=False):
            return
        try:
            if self._waiting or self._rest or not self.ready.is_set() or world is not self._world:
                return
            if not owner.is_known(self._faults, self._revision):
                return
            message = framing.packed(c.NewSample(owner.sample, owner.controllers_sample, None))
            with suppress(OSError):
                sent = self._connection.send(message, socket.MSG_DONTWAIT)
                self._sampled, self._rest = owner.sample.cycle, message[sent:]
        finally:
            self._writing.release()

    def send_sample(self) -> None:
        """Send the newest sample, unless that was done or the other process does not read."""
        owner = self._owner
        with self._writing:
            if self._rest:
                self._write(b"")
            if self._waiting >= _SAMPLES or owner.sample.cycle == self._sampled:
                return
            self._sampled = owner.sample.cycle
            world = owner.world.sample
            if world is self._world:
                world = None
            else:
                self._world = world
            self._send_known()
            self.send(c.NewSample(owner.sample, owner.controllers_sample, world))

    def _send_known(self) -> None:
        """Send changes of the facts that the other process answers itself."""
        owner = self._owner
        try:
            self._faults, faults = owner.faults(self._faults)
            workspace = owner.workspace(self._revision)
        except NotInitializedError:
            # The arm is released already: nothing changes any more.
            return
        if workspace is not None:
            self._revision = workspace.revision
        if faults is not None or workspace is not None:
            self.send(c.Known(faults, workspace))

    def send_record(self, session: str, cycle: m.GoalCycle) -> None:
        """Send a record of a cycle, unless too much waits."""
        if self._waiting < _RECORDS:
            self.send(c.Record(session, cycle))

    @property
    def _waiting(self) -> int:
        return 0 if self._transport is None else self._transport.get_write_buffer_size()

    def pump(self) -> None:
        """Send the events that were not sent yet."""
        self._send_known()
        for _ in range(_EVENTS):
            event = self._owner.events.after(self._cursor)
            if event is None:
                return
            self._cursor = event.number
            if event.what != "gap":
                self.send(c.EventAdded(event))
        if not self._pumping:
            self._pumping = True
            self._loop.call_soon(self._go_on)

    def _go_on(self) -> None:
        self._pumping = False
        self.pump()
