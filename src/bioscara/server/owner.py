"""The owner of an arm: carries out the requests of all clients."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from bioscara.api import messages as m
from bioscara.api.values import fault_value, workspace_value
from bioscara.control.faults.kinds import ArmFault
from bioscara.control.faults.warning import ArmWarning
from bioscara.control.loop.loop import CycleReport
from bioscara.errors import (
    ConflictError,
    InvalidArgumentError,
    LeaseError,
    NotInitializedError,
)
from bioscara.kinematics import Joints
from bioscara.planning import Trajectory
from bioscara.planning.collision.scene import Scene
from bioscara.printing import printable
from bioscara.report import CycleRecord
from bioscara.robot import Robot
from bioscara.robot.operations.fault_handling import Acknowledge
from bioscara.robot.operations.motions.jog import Jog
from bioscara.robot.operations.operation import Operation
from bioscara.robot.operations.running import Status
from bioscara.robot.simulated_faults import simulate_fault
from bioscara.robot.tasks.task import Conditions
from bioscara.robot.workspace.workspace import Workspace
from bioscara.server import log
from bioscara.server.bench_file import BenchFile
from bioscara.server.channel.channel_messages import GoalPaths, KnownFaults
from bioscara.server.clients.client import Client, Later, NamedClient
from bioscara.server.clients.events import Events
from bioscara.server.clients.lease import Lease
from bioscara.server.clients.pauses import Pauses, joined
from bioscara.server.controllers.requests import ClientControllers, Handler
from bioscara.server.controllers.sampling import ControllerSampler
from bioscara.server.kept_files import scene_file, table_file
from bioscara.server.overlay_file import OverlayFile
from bioscara.server.served_world import ServedWorld
from bioscara.server.simulation import ServedBench
from bioscara.server.state.joint_reports import JointReports
from bioscara.server.state.queries import (
    controller_list,
    goal_paths,
    known_faults,
    statistics,
)
from bioscara.server.state.sampling import Sampler
from bioscara.server.tasks.goals import ClientGoal, Goals
from bioscara.server.tasks.jog_stream import JogStream, velocity_of
from bioscara.server.tasks.owner_tasks import OwnerTasks
from bioscara.version import __version__

_log = logging.getLogger(__name__)

_REPORT_MAX = 500
"""Longest text that a client reports to all [characters]."""
_STOP_REPEATED = 2.0
"""Time in which another STOP of a client repeats its first one [s], unless something began since.
"""
_REST = 10.0
"""Time in which a motion that is being stopped is at rest [s], also in simulated time that is slow.
"""
_AFTER_A_STOP = frozenset({"goal_accepted", "pause", "resume", "lease"})
"""Events after which a STOP is another one."""


class Owner:
    """Carries out requests, one at a time; all methods are called in one thread.

    Only :meth:`observe` and :meth:`stop_at_once` are called in the control loop's thread.

    Args:
        robot: The arm, connected; to be watched from now on.
        name: Name of the owner.
        post: Calls a function soon, in the thread of the requests.
        simulated: Whether the arm is simulated.
        overlay: The file with the values in which this arm differs; None if there is none.
        table: The file with the poses; None if they are not kept.
        scene: The file with the zones and the table; None if there is none.
        declared: Scene at the start where there is no such file; None for that of the last owner.
        bench: The file in which the next owner finds the scene, the tool and the load of this one;
            None if they are not kept.
        clock: Returns the time [s].

    Attributes:
        robot: As given.
        name: As given.
        events: The events.
        lease: The lease.
        goals: The goals.
        sample: The state at the end of the last cycle.
        controllers_sample: The controllers at the end of the last cycle, if that was wanted.
        controllers_wanted: Whether a client has subscribed to that.
        world: The bodies around the arm.
        changed: Called with True when there is a new sample, with False when there is a new event.
        sampled: Called in the control loop's thread when there is a new sample; must return at once
            and raise nothing.

    Raises:
        ConfigurationError: The file with the poses, that with the zones, or what the last owner
            has left cannot be read.
    """

    def __init__(
        self,
        robot: Robot,
        name: str,
        post: Callable[[Callable[[], object]], object],
        *,
        simulated: bool,
        overlay: Path | None,
        table: Path | None = None,
        scene: Path | None = None,
        declared: Scene | None = None,
        bench: Path | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.robot, self.name, self._post = robot, name, post
        self._runner, self._arm = robot.runner, robot.runner.arm
        self._simulated, self._clock = simulated, clock
        self._overlay = OverlayFile(overlay)
        self.events = Events(robot.clock.now)
        self.lease = Lease(clock)
        self.goals = Goals()
        self.changed: Callable[[bool], object] = lambda _: None
        self.sampled: Callable[[], object] = lambda: None
        poses, zones = table_file(table, robot.table.fingers), scene_file(scene)
        if (taught := poses.read()) is not None:
            robot.table = taught
        self._bench = BenchFile(bench)
        self._bench.restore(self._arm, zones.read() or declared)
        self._workspace, self._revision = self._content(), 1
        self._revising = threading.Lock()
        self._tasks = OwnerTasks(
            self._arm,
            self._current_revision,
            poses,
            zones,
        )
        self._stoppers: deque[NamedClient] = deque()
        """Clients that have stopped the arm at its loop, which is not reported yet."""
        self._stopped: dict[str, float] = {}
        """When each client stopped the arm last, since something began [s]."""
        self._taken = 0
        """Epoch of the last lease that another client took from its holder."""
        self._joints = JointReports(self._runner, clock)
        self._begin = clock()
        self._sampler = Sampler(self._runner)
        self._pauses = Pauses(self._arm, self.lease)
        self._simulation = ServedBench(
            self._arm, lambda text: post(lambda: self._event("simulation", f"simulated: {text}"))
        )
        self._controllers = ClientControllers(self._runner, self)
        self._controller_sampler = ControllerSampler(self._arm, self._controllers.goals)
        self.controllers_sample: m.ControllersSample | None = None
        self.controllers_wanted = False
        self.world = ServedWorld(self._runner, self.announce)
        self._faults: tuple[ArmFault, ...] = ()
        self._warnings: tuple[ArmWarning, ...] = ()
        self._activity = self._arm.stack.manager.activity
        self._posted = False
        self._over: deque[tuple[ClientGoal, int]] = deque()
        self._handlers: dict[type[m.Command], Handler] = {
            m.SetJogVelocity: lambda _, command, __: self._stream(command.goal).set(
                velocity_of(command)
            ),
            m.EndJog: lambda _, command, __: self._stream(command.goal).end(),
            m.Cancel: lambda _, command, __: self.goals.get(command.goal).operation.cancel(),
            m.PauseGoal: lambda _, command, __: self.goals.get(command.goal).operation.pause(),
            m.ResumeGoal: lambda _, command, __: self.goals.get(command.goal).operation.resume(),
            m.Pause: self._pause,
            m.Resume: self._resume,
            m.SetSpeedOverride: self._set_speed_override,
            m.StopAll: self._stop,
            m.AcquireLease: self._acquire,
            m.RenewLease: self._renew,
            m.ReleaseLease: self._release,
            m.GetState: lambda *_: self._sampler.now(self.sample),
            m.GetDescription: self._describe,
            m.GetWorkspace: lambda *_: self.workspace(),
            m.GetSimulation: lambda *_: self._simulation.state(),
            m.SimulateFault: self._simulate_fault,
            m.SetRealTimeFactor: lambda client, command, _: self._simulation.set_factor(
                command.real_time_factor, client.name
            ),
            m.GetFaults: lambda client, *_: known_faults(self._arm).of(client.session),
            m.GetGoal: lambda _, command, __: m.GoalState(self.goals.get(command.goal).value()),
            m.Report: self._report,
            m.ListGoals: lambda *_: m.GoalList(tuple(goal.value() for goal in self.goals.all)),
            m.GetLease: lambda *_: m.LeaseState(self.lease.value()),
            m.GetParameters: lambda *_: Later(self._overlay.state),
            m.GetJoints: lambda *_: Later(self._joints.ask),
            m.SetParameters: self._set_parameters,
            m.ListControllers: lambda *_: controller_list(self._arm),
            m.GetLog: lambda _, command, __: log.kept.lines(command.after),
            **self._controllers.handlers,
            **self.world.handlers,
        }
        stack = self._arm.stack
        stack.loop.restart()
        self.sample = self._sampler.sample(stack.loop.step())
        self._runner.observers = (*self._runner.observers, self.observe)
        self.events.add("owner", f"{name} serves {robot.description}")
        if self._arm.workspace.unconfirmed:
            words = " and ".join(self._arm.workspace.unconfirmed_words())
            self._event("unconfirmed", f"not confirmed since the owner was started: {words}")

    @property
    def description(self) -> str:
        """Which arm on which bus, in words."""
        return self.robot.description

    @property
    def rate(self) -> int:
        """Control cycles per second [Hz]."""
        return self._arm.stack.loop.rate

    def handle(
        self,
        client: Client,
        command: m.AnyCommand,
        epoch: int | None,
        trajectory: Trajectory | None = None,
    ) -> m.AnyResult | GoalPaths | Later:
        """Carry out a command.

        Args:
            client: Its sender.
            command: The command.
            epoch: Epoch of its lease, if it carries one.
            trajectory: The trajectory to follow, if it is to follow one.

        Raises:
            LeaseError: It needs a lease, and the client does not hold it.
            BioscaraError: It is refused, or failed.
        """
        self._report_stops()
        if isinstance(command, m.GetStatistics):
            return statistics(self._arm, self._clock() - self._begin)
        if command.needs_lease:
            self.expire()
            self.lease.require(client.session, epoch)
        match command:
            case m.Start():
                return self._start(client, command, epoch or 0, trajectory)
            case m.GetTrajectories():
                return goal_paths(self.goals.get(command.goal), command.first)
        return self._handlers[type(command)](client, command, epoch or 0) or m.Done()

    def observe(self, cycle: CycleReport) -> None:
        """Take a sample at the end of a cycle."""
        try:
            self._controllers.goals.observe(self._arm.stack.supervisor)
            self.sample = self._sampler.sample(cycle)
            self.controllers_sample = (
                self._controller_sampler.sample(self.sample.cycle, cycle)
                if self.controllers_wanted
                else None
            )
            self.world.observe(self.sample.cycle, cycle.time)
            self.sampled()
        except Exception as error:  # noqa: BLE001  the loop must go on, and the error is shown
            self._post(partial(self._warn, f"the state cannot be sampled: {error!r}"))
            return
        if not self._posted:
            self._posted = True
            self._post(self._after_cycle)

    def expire(self) -> None:
        """Let the lease lapse if it is due: goals that depend on it are stopped."""
        client = self.lease.client
        if reason := self.lease.lapsed():
            self._lose_lease(reason, client)

    def tick(self) -> None:
        """Do the periodic work that needs no control loop: called now and then."""
        self.expire()
        if not self._runner.watched:
            self.report_ended()

    def report_ended(self, before: int | None = None) -> None:
        """Report the goals that have ended.

        Args:
            before: Only those that ended before this cycle; None for all.
        """
        while self._over and (before is None or self._over[0][1] < before):
            self._report_end(self._over.popleft()[0])

    def _after_cycle(self) -> None:
        self._posted = False
        # First, as clients wait for this.
        self.changed(True)
        self.expire()
        # Clients that see an end see the state after it.
        self.report_ended(self.sample.cycle)
        # The thread that ends the service may disconnect the arm at the same time.
        with suppress(NotInitializedError):
            self._report_faults(self.robot.faults)
            self._report_warnings()
            if (activity := self._arm.stack.manager.activity) != self._activity:
                self._activity = activity
                self._event("controllers", "controllers or hardware components changed their state")
        self._current_revision()
        self._bench.keep(self._arm)

    def _report_faults(self, faults: tuple[ArmFault, ...]) -> None:
        if faults == self._faults:
            return
        known = {(fault.kind, fault.source, fault.time) for fault in self._faults}
        for fault in faults:
            if (fault.kind, fault.source, fault.time) not in known:
                self._event("fault", str(fault), fault=fault_value(fault))
        if not faults:
            self._event("faults_cleared", "the faults are cleared")
        self._faults = faults

    def _report_warnings(self) -> None:
        warnings = self.robot.warnings
        if warnings == self._warnings:
            return
        # The latest are kept; those that are new follow the longest common part.
        for shift in range(len(self._warnings) + 1):
            if self._warnings[shift:] == warnings[: len(self._warnings) - shift]:
                break
        for warning in warnings[len(self._warnings) - shift :]:
            known = warning.author and warning.author == self.lease.holder
            self._event("warning", str(warning), self.lease.client if known else "")
        self._warnings = warnings

    def _warn(self, text: str) -> None:
        self._event("warning", text)

    def _event(self, what: m.EventKind, text: str, client: str = "", **details: Any) -> None:
        self.events.add(what, text, client, **details)
        if what in _AFTER_A_STOP:
            self._stopped.clear()
        level = logging.WARNING if what in {"fault", "warning", "unconfirmed"} else logging.INFO
        _log.log(level, "%s: %s", what, text)
        self.changed(False)

    def announce(self, what: m.EventKind, text: str, client: str = "") -> None:
        """Add an event of the server itself."""
        self._event(what, text, client)

    def _acquire(self, client: Client, command: m.AcquireLease, _: int) -> m.LeaseState:
        self.expire()
        lease = self.lease
        former, name = lease.holder, lease.client
        lease.acquire(client, command.time_to_live, force=command.force)
        if former and former != client.session:
            # Goals that may finish without the lease, too: it is taken to stop the motion.
            self._taken = lease.epoch - 1
            for goal in self.goals.running:
                if goal.session == former:
                    goal.operation.cancel()
            text = f"{client.name} took the lease over from {name}"
        else:
            text = f"{client.name} commands the arm"
        if former != client.session:
            self._event("lease", text, client.name, lease=lease.value())
        return m.LeaseState(lease.value())

    def _renew(self, *_: object) -> m.LeaseState:
        self.lease.renew()
        return m.LeaseState(self.lease.value())

    def _release(self, client: Client, *_: object) -> None:
        self.lease.end()
        self._lose_lease(f"{client.name} released the lease", client.name, client.session)

    def _lose_lease(self, text: str, client: str, session: str = "") -> None:
        self._stop_dependent(session)
        self._event("lease", text, client, lease=self.lease.value())

    def _stop_dependent(self, session: str) -> None:
        """Stop the goals that may not go on without the lease, of a session or of all."""
        for goal in self.goals.running:
            if session and goal.session != session:
                continue
            if goal.needs_lease:
                goal.operation.cancel()

    def _start(
        self, client: Client, command: m.Start, epoch: int, trajectory: Trajectory | None
    ) -> Later:
        number = self.goals.reserve()

        def observe(record: CycleRecord) -> None:
            self._post(lambda: client.send_record(number, record))

        conditions = Conditions(command.timeout, observe if command.records else None)
        operation = self._tasks.operation(command.task, conditions, trajectory)
        operation.author = client.session
        check = self.check(operation.name, client, epoch)
        revision = getattr(command.task, "revision", None)

        def admit() -> None:
            check()
            # All devices are claimed: nothing else changes the workspace from here on.
            if revision is not None and revision != self._current_revision():
                raise self._conflict(self._current_revision())

        def finish(_: object) -> m.Accepted:
            return m.Accepted(self.keep(operation, client, epoch, command.on_lease_loss, number))

        # A program that follows another one at once would be refused while the arm brakes.
        stopping = [
            goal.operation
            for goal in self.goals.running
            if goal.epoch < epoch and goal.operation.status is Status.STOPPING
        ]

        def begin() -> None:
            end = time.monotonic() + _REST
            for former in stopping:
                former.wait(max(end - time.monotonic(), 0.0))
            self._runner.begin(operation, admit)

        return Later(begin, finish)

    def check(self, name: str, client: Client, epoch: int) -> Callable[[], None]:
        """Return a function that raises if the arm was stopped or the lease ended since.

        Args:
            name: Name of an operation. Called once its devices are claimed, the function misses no
                stop: one from then on reaches the operation itself.
            client: The client that begins it.
            epoch: Epoch of its lease.
        """
        call = self._arm.stops.call()

        def check() -> None:
            call.require(name)
            if (self.lease.epoch, self.lease.holder) != (epoch, client.session):
                raise LeaseError(f"{name}: the lease ended before anything moved")

        return check

    def keep(
        self,
        operation: Operation[Any],
        client: Client,
        epoch: int,
        on_lease_loss: m.OnLeaseLoss = "stop",
        number: int = 0,
    ) -> m.GoalValue:
        """Keep an operation that has begun as a goal.

        Args:
            operation: The operation.
            client: The client that began it.
            epoch: Epoch of its lease.
            on_lease_loss: Whether it stops or finishes when that lapses or is released.
            number: A number that was reserved for it; 0 for the next.
        """
        goals = self.goals
        goal = ClientGoal(
            number or goals.reserve(), operation, client.session, client.name, epoch, on_lease_loss
        )
        value = goal.value()
        goals.keep(goal)
        self._event("goal_accepted", f"{operation.name} by {client.name}", client.name, goal=value)
        # The lease may have ended while the motion was planned.
        self.expire()
        lease = self.lease
        lost = (lease.epoch, lease.holder) != (epoch, client.session)
        if lost and (goal.needs_lease or epoch <= self._taken):
            operation.cancel()
        operation.when_done(lambda: self._over.append((goal, self.sample.cycle)))
        return value

    def _report_end(self, goal: ClientGoal) -> None:
        value = goal.value()
        reasons = [each.text for each in (value.failure, value.limitation) if each is not None]
        reason = f": {'; '.join(reasons)}" if reasons else ""
        text = f"{value.name} by {value.client} {value.status}{reason}"
        if isinstance(goal.operation, Acknowledge) and goal.operation.error is None:
            self._report_acknowledged(goal.operation.result(), value.client)
        self._event("goal_ended", text, value.client, goal=value)

    def _report_acknowledged(self, faults: tuple[ArmFault, ...], client: str) -> None:
        """Report faults with their evidence, also those from which the arm has recovered since."""
        self._report_faults(faults)
        for fault in faults:
            name = "none" if fault.evidence is None else fault.evidence.name
            text = f"{client} acknowledged {fault.kind.name} of {fault.source}; evidence: {name}"
            self._event("acknowledged", text, client, fault=fault_value(fault))

    def _stream(self, number: int) -> JogStream:
        operation = self.goals.get(number).operation
        if not isinstance(operation, Jog) or not isinstance(operation.velocities, JogStream):
            raise InvalidArgumentError(f"goal {number} is {operation.name}, not a jog")
        if operation.done:
            operation.result()
            raise InvalidArgumentError(f"the jog {number} has ended; begin another one")
        return operation.velocities

    def _pause(self, client: Client, command: m.Pause, _: int) -> None:
        if self._pauses.begin(client, may_resume=command.may_resume):
            self._event("pause", f"{client.name} paused all motion", client.name)

    def _resume(self, client: Client, *_: object) -> None:
        self.expire()
        if not self._pauses.lift(client):
            return
        text = f"{client.name} resumed the motion"
        if left := self._arm.pauses.values():
            text = f"{client.name} lifted its pause; motion stays paused by {joined([*left])}"
        self._event("resume", text, client.name)

    def _set_speed_override(self, client: Client, command: m.SetSpeedOverride, _: int) -> None:
        self.robot.speed_override = command.share
        text = f"{client.name} set the speed to {command.share:.0%}"
        self._event("speed_override", text, client.name)

    def _simulate_fault(self, client: Client, command: m.SimulateFault, _: int) -> Later:
        def finish(what: str) -> None:
            self._event("simulation", f"{client.name} simulates: {what}", client.name)

        fault, joint, value = command.fault, command.joint, command.value
        return Later(lambda: simulate_fault(self._runner, fault, joint, value), finish)

    def stop_at_once(self, clients: Sequence[NamedClient]) -> None:
        """Stop all motion for clients, in the thread of the control loop.

        Leases end before the next command is carried out.
        """
        self.robot.stop()
        self._stoppers.extend(clients)
        self._post(self._report_stops)

    def _report_stops(self) -> None:
        with suppress(IndexError):
            while True:
                self._note_stop(self._stoppers.popleft())

    def _stop(self, client: Client, *_: object) -> None:
        # First the arm, then all else.
        self.robot.stop()
        self._note_stop(client)

    def _note_stop(self, client: NamedClient) -> None:
        holder, repeated = self.lease.holder, self._is_repeated(client)
        text = f"{client.name} stopped all motion"
        if holder and holder != client.session:
            # Commands that were sent before their client saw the stop must not move the arm again.
            text += f", and ended the lease of {self.lease.client}"
            self.lease.end()
        elif repeated:
            return
        self._event("stop", text, client.name, lease=self.lease.value())

    def _is_repeated(self, client: NamedClient) -> bool:
        """Return whether a STOP only repeats one: programs send it until the arm is at rest."""
        now = self._clock()
        recent = {key: time for key, time in self._stopped.items() if now - time < _STOP_REPEATED}
        repeated = client.session in recent
        # An event in each two seconds, however often it is repeated.
        self._stopped = recent if repeated else {**recent, client.session: now}
        return repeated

    def workspace(self, known: int = 0) -> m.WorkspaceState | None:
        """Return tool, scene and load; None if they are those with a number that is known."""
        revision = self._current_revision()
        return None if revision == known else workspace_value(self._arm.workspace, revision)

    def faults(self, known: object = None) -> tuple[object, KnownFaults | None]:
        """Return a key of the faults and warnings, and them; None if the key is known."""
        supervisor = self._arm.stack.supervisor
        key = supervisor.state, tuple(supervisor.faults), tuple(supervisor.warnings)
        return key, None if key == known else known_faults(self._arm)

    def is_known(self, faults: object, revision: int) -> bool:
        """Return whether faults and workspace are those of a key and a number; takes no lock."""
        supervisor = self._arm.stack.supervisor
        same = zip(self._content(), self._workspace, strict=True)
        return (
            self._revision == revision
            and all(a is b for a, b in same)
            and (supervisor.state, tuple(supervisor.faults), tuple(supervisor.warnings)) == faults
        )

    def planning_start(self) -> tuple[Workspace, Joints]:
        """Return tool, scene and load, and where the joints are [rad, m, rad, rad].

        Raises:
            BioscaraError: It is not known where they are.
        """
        return self._arm.workspace, self._arm.positions()

    def _describe(self, *_: object) -> m.Description:
        loop = self._arm.stack.loop
        return m.Description(
            name=self.name,
            arm=self.robot.description,
            simulated=self._simulated,
            parameters=self.robot.parameters,
            rate=loop.rate,
            bus_share=loop.bus_share,
            firmware=self.robot.firmware,
            software=__version__,
        )

    def _set_parameters(self, client: Client, command: m.SetParameters, _: int) -> Later:
        def finish(state: m.ParametersState) -> m.ParametersState:
            self._event("parameters", f"{client.name} changed the overlay", client.name)
            return state

        return Later(lambda: self._overlay.write(command.overlay, command.revision), finish)

    def _report(self, client: Client, command: m.Report, _: int) -> None:
        text = command.text
        if not 0 < len(text) <= _REPORT_MAX:
            raise InvalidArgumentError(
                f"a report has 1 to {_REPORT_MAX} characters, not {len(text)}; shorten it"
            )
        self._event("report", f"{client.name}: {printable(text)}", client.name)

    def _content(self) -> tuple[object, ...]:
        space: Workspace = self._arm.workspace
        return (
            *(space.scene, space.table, space.tool, space.reduced_speed, space.load),
            space.unconfirmed,
        )

    def _current_revision(self) -> int:
        """Return the number of the present workspace; called by any thread."""
        with self._revising:
            content = self._content()
            if any(a is not b for a, b in zip(content, self._workspace, strict=True)):
                self._workspace = content
                self._revision += 1
                text = f"the workspace is number {self._revision} now"
                self._post(lambda: self._event("workspace", text))
            return self._revision

    @staticmethod
    def _conflict(revision: int) -> ConflictError:
        return ConflictError(
            f"another client has changed the workspace, which is number {revision} now; read it "
            "again and repeat the change",
            revision,
        )


def run(result: m.AnyResult | Later) -> m.AnyResult:
    """Finish a request in this thread."""
    return result.ended(result.work()) if isinstance(result, Later) else result
