"""The owner as the process of its clients sees it, at the other end of the channel."""

from __future__ import annotations

import asyncio
import itertools
import math
import mmap
import os
import pickle
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from typing import Any

import msgspec

from bioscara.api import framing, messages as m
from bioscara.api.failures import error_of
from bioscara.api.values import trajectory_of
from bioscara.errors import InvalidArgumentError, LeaseError, OwnerLostError
from bioscara.planning import Trajectory
from bioscara.processes.worker_pool import WorkerPool
from bioscara.server.channel import channel_messages as c, work
from bioscara.server.channel.budget import COMMANDS, Budget
from bioscara.server.channel.known_state import KnownState
from bioscara.server.clients.client import ConnectedClient, Encoded
from bioscara.server.clients.events import Events
from bioscara.server.state.history import StateHistory
from bioscara.server.state.queries import resident
from bioscara.server.tasks.uploads import TrajectoryUploads

PLANS, PLAN_BYTES = 32, 64 << 20
"""Plans that are kept, and their memory [byte]."""
_PLANNING, _READING = 30.0, 5.0
"""Longest time of a plan, and of another answer of a worker [s]."""
_WORKERS, _MEMORY, _NICE = 2, 256, 10
"""Processes for the questions of all clients, the memory of a question [MiB], and how far they give
way to the control loop."""
_DRAWN = 1024
"""Memory of an image [MiB]."""
_EACH, _MOST = 8, 64
"""Questions of a client and of all that wait for a worker."""
_SLOW = 5.0
"""Turns that a question takes which occupies a thread of the owner."""
_STOP_PERIOD = 0.01
"""Time in which stops that come after another one are passed on as one [s]: one control cycle."""
SILENCE = 2.0
"""Time without a message of the owner after which it counts as lost [s]; each cycle has one."""
_LOOK = 0.25
"""Period of the look for that [s]."""
_LONGEST = 256 << 20
"""Longest message of the channel [byte]."""
_NOTHING = m.TrajectoryValue((), (), (), None, None)


class OwnerProxy(asyncio.Protocol):
    """Passes commands on to the process that moves the arm, and answers what needs no loop.

    The holder of the lease is never limited here. All others share a budget, and have turns.

    Attributes:
        name: Name of the owner.
        description: Which arm on which bus, in words.
        group: Number of the group whose members may be clients; None for this user alone.
        events: Its latest events.
        controllers_sample: The newest sample of the controllers, if that is wanted.
        world_sample: The newest sample of the world, once one was wanted.
        changed: Called with True when there is a new sample, with False when there is a new event.
        on_record: Called with a session and the record of a cycle for it.
        begun: Done once the first message has come.
        ended: Done when the arm is released or the other process has ended.
    """

    def __init__(self) -> None:
        loop = asyncio.get_running_loop()
        self.name = self.description = ""
        self.group: int | None = None
        self._known: KnownState
        self.controllers_sample: m.ControllersSample | None = None
        self.world_sample: m.WorldSample | None = None
        self.changed: Callable[[bool], object] = lambda _: None
        self.on_record: Callable[[str, m.GoalCycle], object] = lambda *_: None
        self.begun: asyncio.Future[None] = loop.create_future()
        self.ended: asyncio.Future[None] = loop.create_future()
        self.events = Events(lambda: self.sample.time)
        self._loop, self._frames = loop, framing.MessageSplitter(_LONGEST)
        self._transport: asyncio.Transport | None = None
        self._heard = loop.time()
        self._numbers = itertools.count(1)
        self._pending: dict[int, asyncio.Future[msgspec.Raw]] = {}
        self._budget, self._commanding = Budget(), Budget(COMMANDS)
        self._asked: dict[bytes, asyncio.Task[msgspec.Raw]] = {}
        self._holder = ""
        self._stops: dict[str, tuple[ConnectedClient, asyncio.Future[m.AnyResult]]] = {}
        self._stopped = -math.inf
        self._pool = WorkerPool(
            "bioscara-query", _WORKERS, memory=_MEMORY, nice=_NICE, each=_EACH, most=_MOST
        )
        # Apart: the first image of a process takes a second.
        self._drawing = WorkerPool(
            "bioscara-image", 1, memory=_DRAWN, nice=_NICE, each=_EACH, most=_MOST
        )
        self._uploads = TrajectoryUploads()
        self._plans: OrderedDict[int, bytes] = OrderedDict()
        self._plan_numbers = itertools.count(1)
        self._evidence = ""
        self._history: StateHistory
        self._memory: tuple[int, int, tuple[str, ...], int]
        self._wanted = c.Wanted(controllers=False, world=False)
        self._answers: dict[type[m.Command], Callable[..., Awaitable[m.AnyResult | Encoded]]] = {
            m.StopAll: self._stop,
            m.MakePlan: self._plan,
            m.GetTrajectories: self._trajectories,
            m.GetImage: self._image,
            m.AddPoints: self._add_points,
            m.GetHistory: lambda client, command: self._computed(
                client, work.history, self._memory, command
            ),
            m.ListFlightRecords: lambda client, _: self._computed(
                client, work.flight_record_list, self._evidence
            ),
            m.GetFlightRecord: lambda client, command: self._computed(
                client, work.flight_record_part, self._evidence, command
            ),
        }
        """How a command is answered here."""

    # The channel.

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        assert isinstance(transport, asyncio.Transport)  # noqa: S101  of a socket
        self._transport = transport

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002  asyncio's form
        """The process that moves the arm has ended."""
        self._transport = None
        self._refuse(OwnerLostError(f"the owner of arm {self.name} has ended"))
        self._end()

    def data_received(self, data: bytes) -> None:
        """Take messages."""
        self._heard = self._loop.time()
        for payload in self._frames.feed(data):
            self._receive(c.from_owner_process.decode(payload))

    def _receive(self, message: Any) -> None:
        match message:
            case c.Known():
                self._known.change(message)
            case c.NewSample():
                self._known.take(message.state)
                self.controllers_sample = message.controllers
                self.world_sample = message.world or self.world_sample
                # First, as clients wait for this.
                self.changed(True)
                self._history.add(message.state)
            case c.Answered():
                self._settle(message.id).set_result(message.result)
            case c.Refused():
                self._settle(message.id).set_exception(error_of(message.failure))
            case c.EventAdded():
                event = message.event
                if event.lease is not None and event.lease.client is None:
                    self._holder = ""
                self.events.keep(event)
                self.changed(False)
            case c.Record():
                self.on_record(message.session, message.cycle)
            case c.AskAlive():
                self.send(c.Alive())
            case c.Begin():
                self._begin(message)
            case c.End():
                self._end()

    def _begin(self, begin: c.Begin) -> None:
        self.name, self.description, self.group = begin.name, begin.arm, begin.group
        self._known, self._evidence = KnownState(begin.sample), begin.evidence
        names = begin.sample.names
        file = os.memfd_create("bioscara-history", os.MFD_CLOEXEC)
        os.ftruncate(file, StateHistory.size(len(names), begin.rate))
        self._history = StateHistory(names, begin.rate, mmap.mmap(file, 0))
        self._memory = os.getpid(), file, names, begin.rate
        self.begun.set_result(None)

    def _end(self) -> None:
        if not self.ended.done():
            self.ended.set_result(None)

    def _settle(self, number: int) -> asyncio.Future[Any]:
        """Return the future of an answer, or one for an answer that is not awaited."""
        future = self._pending.pop(number, None)
        return self._loop.create_future() if future is None or future.done() else future

    def send(self, message: c.ChannelMessage) -> None:
        """Send a message, unless the other process has ended."""
        if self._transport is not None:
            self._transport.write(framing.packed(message))

    async def _call(self, message: Callable[[int], c.ChannelMessage]) -> msgspec.Raw:
        if self._transport is None:
            raise OwnerLostError(f"the owner of arm {self.name} has ended")
        number = next(self._numbers)
        answer: asyncio.Future[msgspec.Raw] = self._loop.create_future()
        self._pending[number] = answer
        self.send(message(number))
        return await answer

    async def watch(self) -> None:
        """Refuse what waits for an answer of the owner, while that is silent for too long."""
        before = self._loop.time()
        while True:
            await asyncio.sleep(_LOOK)
            now = self._loop.time()
            if now - before > 2.0 * _LOOK:
                # This process was suspended, too, and has not read all messages.
                self._heard = now
            before = now
            if (silent := now - self._heard) >= SILENCE:
                self._refuse(
                    OwnerLostError(
                        f"the owner of arm {self.name} has been silent for {silent:.1f} s: it was "
                        "stopped, or its computer is overloaded"
                    )
                )

    def _refuse(self, error: OwnerLostError) -> None:
        pending, self._pending = self._pending, {}
        for future in pending.values():
            if not future.done():
                future.set_exception(error)

    def start(self) -> None:
        """Begin the processes that compute."""
        self._pool.start()

    async def close(self) -> None:
        """End them."""
        await self._pool.close()
        await self._drawing.close()

    # The interface of an arm for the socket of the clients.

    def want(self, *, controllers: bool, world: bool) -> None:
        """Let the owner make the samples to which a client has subscribed."""
        wanted = c.Wanted(controllers, world)
        if wanted != self._wanted:
            self._wanted = wanted
            self.send(wanted)

    @property
    def sample(self) -> m.StateSample:
        """The newest state."""
        return self._known.sample

    def announce(self, what: m.EventKind, text: str, client: str) -> None:
        """Let the owner add an event."""
        self.send(c.AddEvent(what, text, client))

    def tick(self) -> None:
        """Do nothing: the lease is the owner's."""

    def state_of(self, session: str, *, connected: bool, gone: bool, forgotten: bool) -> None:
        """Send the owner how a client is connected."""
        if forgotten and session == self._holder:
            self._holder = ""
        self.send(c.SessionState(session, connected, gone, forgotten))

    def handle(
        self, client: ConnectedClient, command: m.AnyCommand, epoch: int | None, clients: int
    ) -> m.AnyResult | Awaitable[m.AnyResult | Encoded]:
        """Carry out a command; arguments and errors as of ``Owner``."""
        answer: Callable[..., Awaitable[m.AnyResult | Encoded]] | None
        if (answer := self._answers.get(type(command))) is not None:
            return answer(client, command)
        if isinstance(command, m.GetStatistics):
            return self._statistics(client, command, clients)
        if isinstance(command, m.Query):
            known = None
            if client.session != self._holder:
                known = self._known.answer(client.session, command)
            return self._ask(client, command) if known is None else known
        return self._command(client, command, epoch)

    async def _command(
        self, client: ConnectedClient, command: m.AnyCommand, epoch: int | None
    ) -> m.AnyResult:
        trajectory = b""
        if isinstance(command, m.Start):
            command, trajectory = self._with_points(command)
        if client.session != self._holder:
            await self._commanding.turn(client.session)
        given = c.Handle(
            id=0,
            session=client.session,
            client=client.name,
            command=command,
            epoch=epoch,
            trajectory=trajectory,
        )
        try:
            data = await self._call(lambda number: msgspec.structs.replace(given, id=number))
        finally:
            self._known.commanded(command)
        result: m.AnyResult = c.any_result.decode(data)
        if isinstance(command, m.AcquireLease):
            self._holder = client.session
        return result

    def _with_points(self, command: m.Start) -> tuple[m.Start, bytes]:
        """Return a command without the points of its trajectory, and these as bytes.

        Raises:
            InvalidArgumentError: There is no such plan or upload, or the points are no trajectory.
        """
        task = command.task
        if isinstance(task, m.Execute):
            if task.plan not in self._plans:
                raise InvalidArgumentError(
                    f"there is no plan {task.plan}, or it was dropped for newer ones; plan it again"
                )
            return command, self._plans[task.plan]
        if isinstance(task, m.Follow):
            trajectory: Trajectory = self._uploads.trajectory(task.upload, task.trajectory)
            short = msgspec.structs.replace(task, trajectory=_NOTHING, upload=0)
            return msgspec.structs.replace(command, task=short), pickle.dumps(trajectory)
        return command, b""

    async def _statistics(
        self, client: ConnectedClient, command: m.GetStatistics, clients: int
    ) -> m.AnyResult:
        data = await self._asked_once(client.session, command)
        loop: m.Statistics = c.any_result.decode(data)
        return msgspec.structs.replace(loop, clients=clients, memory=loop.memory + resident())

    async def _add_points(self, client: ConnectedClient, command: m.AddPoints) -> m.AnyResult:
        if client.session != self._holder:
            raise LeaseError("this needs the lease of the arm; acquire it first")
        return self._uploads.add(command.upload, trajectory_of(command.points))

    async def _ask(self, client: ConnectedClient, command: m.Query) -> Encoded:
        return self._formed(client, await self._asked_once(client.session, command))

    def _formed(self, client: ConnectedClient, data: msgspec.Raw) -> Encoded:
        """Return the result of a question in the form of the client."""
        if client.json:
            return Encoded(framing.encode_json(msgspec.msgpack.decode(data)))
        return Encoded(bytes(data))

    async def _asked_once(self, session: str, command: Any) -> msgspec.Raw:
        """Return the answer to a question, which waits for its turn once for all that ask it."""
        key = framing.encode_packed(command)
        asking = None if session == self._holder else self._asked.get(key)
        if asking is None:
            asking = self._loop.create_task(self._asked_in_turn(session, key, command))
            self._asked[key] = asking
            # All that wait for it may leave.
            asking.add_done_callback(lambda task: task.cancelled() or task.exception())
        # Another client may wait for the same answer.
        return await asyncio.shield(asking)

    async def _asked_in_turn(self, session: str, key: bytes, command: Any) -> msgspec.Raw:
        try:
            if session != self._holder:
                await self._budget.turn(session, _SLOW if getattr(command, "slow", False) else 1.0)
        finally:
            # A question that comes from now on gets a newer answer.
            self._asked.pop(key, None)
        if isinstance(command, c.AskPlanningStart):
            return await self._call(c.AskPlanningStart)
        return await self._call(
            lambda number: c.Handle(
                id=number, session=session, client="", command=command, epoch=None
            )
        )

    async def _computed(
        self, client: ConnectedClient, function: Callable[..., bytes], *args: Any
    ) -> Encoded:
        data = await self._pool.run(client.session, _READING, function, *args, client.json)
        return Encoded(data)

    async def _plan(self, client: ConnectedClient, command: m.MakePlan) -> Encoded:
        data = await self._asked_once(client.session, c.AskPlanningStart(0))
        start: c.PlanningStart = c.internal.decode(data)
        number = next(self._plan_numbers)
        answer, trajectory = await self._pool.run(
            client.session,
            _PLANNING,
            work.plan,
            start.workspace,
            start.positions,
            command.motion,
            number,
            client.json,
        )
        self._plans[number] = trajectory
        while len(self._plans) > PLANS or sum(map(len, self._plans.values())) > PLAN_BYTES:
            self._plans.popitem(last=False)
        return Encoded(answer)

    async def _trajectories(self, client: ConnectedClient, command: m.GetTrajectories) -> Encoded:
        data = await self._asked_once(client.session, command)
        paths: c.GoalPaths = c.internal.decode(data)
        return await self._computed(
            client, work.trajectories, command.goal, paths.points, paths.paths
        )

    async def _image(self, client: ConnectedClient, command: m.GetImage) -> Encoded:
        data = await self._asked_once(client.session, command)
        still: c.WorldStill = c.internal.decode(data)
        image = await self._drawing.run(
            client.session, _PLANNING, work.image, command, still, client.json
        )
        return Encoded(image)

    async def _stop(self, client: ConnectedClient, _: m.StopAll) -> m.AnyResult:
        """Pass a STOP on: the first at once, those in the cycle after it as one."""
        done: asyncio.Future[m.AnyResult]
        waiting = self._stops.get(client.session)
        if waiting is not None:
            done = waiting[1]
        else:
            done = self._loop.create_future()
            if not self._stops:
                due = self._stopped + _STOP_PERIOD
                self._loop.call_at(max(due, self._loop.time()), self._pass_stops)
            self._stops[client.session] = client, done
            if self._loop.time() >= self._stopped + _STOP_PERIOD:
                self._pass_stops()
        return await asyncio.shield(done)

    def _pass_stops(self) -> None:
        if not self._stops:
            return
        waiting, self._stops = self._stops, {}
        self._stopped = self._loop.time()
        # One that does not command ends the lease of the one that does.
        others = [each for each, _ in waiting.values() if each.session != self._holder]
        client = others[0] if others else next(iter(waiting.values()))[0]
        task = self._loop.create_task(
            self._call(
                lambda number: c.Handle(
                    id=number,
                    session=client.session,
                    client=client.name,
                    command=m.StopAll(),
                    epoch=None,
                )
            )
        )

        def settle(task: asyncio.Task[msgspec.Raw]) -> None:
            error = None if task.cancelled() else task.exception()
            self._known.commanded(m.StopAll())
            for _, done in waiting.values():
                if done.done():
                    continue
                if error is not None:
                    done.set_exception(error)
                    done.exception()
                else:
                    done.set_result(m.Done())

        task.add_done_callback(settle)
