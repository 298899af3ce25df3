"""A robot that another process owns."""

from __future__ import annotations

import _thread
import math
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, ClassVar, Self, TypeVar

from bioscara.api import messages as m
from bioscara.api.values import (
    QUALITIES,
    fault_of,
    scene_value,
    trajectory_parts,
    warnings_of,
    workspace_of,
)
from bioscara.arguments import flag, function, number, shown
from bioscara.control.controllers.joint_state_broadcaster import JointStates
from bioscara.control.faults.kinds import ArmFault
from bioscara.control.faults.supervisor import refusal
from bioscara.control.faults.warning import ArmWarning
from bioscara.errors import (
    BioscaraError,
    FaultedError,
    InvalidArgumentError,
    LeaseError,
    LifecycleError,
    NotHomedError,
    NotInitializedError,
    NotSupportedError,
    OwnerError,
    OwnerLostError,
)
from bioscara.kinematics import Joints, Pose
from bioscara.model import ArmParameters
from bioscara.planning import Trajectory
from bioscara.planning.collision.scene import Scene
from bioscara.planning.motions.jog import JointVelocity, require_velocity
from bioscara.planning.motions.jog_limitation import JogLimitation
from bioscara.remote.lease_keeper import LeaseKeeper
from bioscara.remote.link import OwnerLink
from bioscara.remote.remote_controllers import RemoteControllers
from bioscara.remote.remote_operation import Beginning, RemoteOperation
from bioscara.remote.remote_simulation import RemoteSimulation
from bioscara.remote.transport import Transport
from bioscara.robot.arm_methods import ArmMethods, Glance, condition
from bioscara.robot.call_log import called, flush, log, logged, refused
from bioscara.robot.connection import exit_guard
from bioscara.robot.operations.motions.jog import Velocity
from bioscara.robot.operations.operation import OnCycle
from bioscara.robot.operations.running import Status
from bioscara.robot.robot_gripper import RobotGripper
from bioscara.robot.stops import Call, Stops
from bioscara.robot.tasks.task import Conditions, require_task
from bioscara.robot.workspace.poses import TeachTable
from bioscara.robot.workspace.workspace import Workspace

R = TypeVar("R", bound=m.Result)

_JOG_PERIOD = 0.02
"""Time between two velocities of a jog [s]."""
_REST_TIMEOUT = 15.0
"""Longest time in which the motions of a program that ends come to rest [s]."""
_RETRY = 0.05
"""Time between two attempts to get what another program has [s]."""
_SIGN_OF_LIFE = 0.1
"""Time between two samples that show that the owner lives, on the arm's clock [s]."""
_EARLY = 64
"""Goals whose messages are kept until their handle exists."""


class RemoteRobot(ArmMethods):
    """An arm that another process owns.

    Created by ``Robot.connect("arm:NAME")``, or with the address of its gateway,
    ``Robot.connect("https://HOST:8080")``. :meth:`open` connects to the owner, and nothing moves;
    :meth:`close` stops the program's motions and leaves the arm as it is. However the program ends,
    its motions are stopped. The first command takes the lease: only one program commands the arm at
    a time, any may look and :meth:`stop`. It waits until the motion of an ended program is at rest.
    Errors are those of a robot; also OwnerLostError, and LeaseError where another program commands
    the arm or has stopped it.

    Callbacks are called in the thread that waits for the motion, or in one of their own. While a
    connection is broken, calls wait for it up to 5 s, unless the owner has ended.

    Args:
        owner: Name of the arm's owner, or the way to it.
        lost: Called in the connection's thread when the owner has ended or was restarted.
        timeout: Longest time for which :meth:`open` waits until the owner runs [s].
        client: Name of this client, for messages to people; None for its program and process.

    Attributes:
        controllers: Controllers that clients load into the owner.
    """

    _own: ClassVar[frozenset[str]] = frozenset({"gripper", "controllers"})

    def __init__(
        self,
        owner: str | Transport,
        *,
        lost: Callable[[OwnerLostError], object] | None = None,
        timeout: float = 0.0,
        client: str | None = None,
    ) -> None:
        self._lost = lost
        self._timeout = _timeout(timeout)
        self._link = OwnerLink(owner, self._receive, self._owner_lost, client=client)
        self._name = self._link.name
        self._lease = LeaseKeeper(self._link)
        self._operations: dict[int, RemoteOperation[Any]] = {}
        self._early: OrderedDict[int, list[m.Event | m.GoalCycle]] = OrderedDict()
        self._registering = threading.Lock()
        self._opened = self._closed = False
        self._workspace: tuple[m.WorkspaceState, Workspace] | None = None
        self._description: m.Description | None = None
        self._simulation = RemoteSimulation(self._ask, self._link.subscribe_to_world)
        self.gripper = RobotGripper(self.do, self._jaws)
        self.controllers = RemoteControllers(
            self._command_for, self._ask, self._link.subscribe_to_controllers
        )

    def open(self) -> Self:
        self._link.maker.require()
        if self._closed:
            raise LifecycleError("the robot was closed; make another one to connect again")
        if self._opened:
            raise LifecycleError("the robot is connected already; use the one there is")
        try:
            _retried(self._link.open, OwnerLostError, self._timeout)
            self._link.subscribe(states=True, period=_SIGN_OF_LIFE)
        except BaseException as error:
            refused("open()", error)
            raise
        self._opened = True
        exit_guard.guard(self, self._let_go)
        self._description = self._ask(m.GetDescription(), m.Description)
        log.info("connected: %s", self.description)
        return self

    def _let_go(self) -> None:
        """Give the lease back without waiting, from a handler of a signal."""
        # The modules that make threads take locks that the interrupted thread may hold.
        _thread.start_new_thread(self._lease.release, ())

    def close(self) -> None:
        if not self._opened or self._closed or self._link.maker.left:
            self._closed = True
            return
        try:
            with exit_guard.postponed():
                if self._lease.release():
                    end = time.monotonic() + _REST_TIMEOUT
                    for operation in list(self._operations.values()):
                        operation.wait(max(end - time.monotonic(), 0.0))
        finally:
            self._closed = True
            self._link.close()
            exit_guard.forget(self)
        flush()
        log.info("closed: arm %s", self._name)

    @property
    def is_open(self) -> bool:
        return self._opened and not self._closed

    def shutdown(self) -> list[str]:
        self._link.maker.require()
        for operation in list(self._operations.values()):
            operation.cancel()
            operation.wait()
        return []

    def watch(self, *, priority: int | None = None, real_time_factor: float = 1.0) -> None:
        if priority is not None or real_time_factor != 1.0:
            raise NotSupportedError(
                "priority and real_time_factor are the owner's: bioscara serve --priority, "
                "--real-time-factor"
            )

    def require_heard(self) -> None:
        """Raise if the owner has been silent for too long: 2 s, beyond a gateway 5 s.

        This is also so while a broken connection is made again, for which calls wait longer.

        Raises:
            OwnerLostError: It has.
        """
        self._link.require_heard(reconnecting=False)

    def acquire_lease(self, *, force: bool = False, timeout: float = 0.0) -> None:
        """Take the lease of the arm.

        Needed after another program has stopped the arm; otherwise the first command takes it.

        Args:
            force: Whether to take it from another program, whose motion is stopped.
            timeout: Longest time to wait for another program to release it [s].

        Raises:
            InvalidArgumentError: The time to wait is below zero or not a number.
            LeaseError: Another program commands the arm, also after that time; or the arm was
                stopped in that time.
        """
        self._require_open()
        flag("force", force)
        call = self._lease.stops.call()

        def attempt() -> None:
            if not call.stopped:
                self._lease.acquire(force=force)
            if call.stopped:
                # The stop ended the lease that this program waited for: it would move the arm.
                self._lease.release()
                raise LeaseError(
                    "the arm was stopped while this program waited for the lease; "
                    "acquire_lease() once the arm is safe to move again"
                )

        _retried(attempt, LeaseError, _timeout(timeout), lambda: call.stopped)

    def release_lease(self) -> None:
        """Let other programs command the arm; the motions of this one are stopped."""
        self._require_open()
        self._lease.release()

    @property
    def parameters(self) -> ArmParameters:
        return self._described().parameters

    @property
    def description(self) -> str:
        return f"arm {self._name}: {self._described().arm}"

    @property
    def period(self) -> float:
        return 1.0 / self._described().rate

    @property
    def bus_share(self) -> float:
        return self._described().bus_share

    @property
    def firmware(self) -> tuple[str, ...]:
        return self._described().firmware

    @property
    def flags(self) -> tuple[int, ...]:
        return self._sample().flags

    @property
    def state(self) -> JointStates:
        sample = self._sample()
        if sample.stale:
            self._require_clear()
            raise BioscaraError("the joints are released and report no state; enable() them")
        return _states(sample)

    @property
    def pose(self) -> Pose:
        sample = self._sample()
        if sample.pose is None:
            self._positions("the pose of the tool is unknown")
            raise BioscaraError("the pose of the tool is unknown")
        return sample.pose

    @property
    def paused_by(self) -> tuple[str, ...]:
        return self._sample().paused_by

    @property
    def is_enabled(self) -> bool:
        return self.is_open and self._sample().enabled

    @property
    def is_moving(self) -> bool:
        return self.is_open and bool(self._sample().moving)

    @property
    def _held(self) -> bool:
        sample = self._sample()
        if sample.paused or sample.speed_override == 0.0:
            return True
        goals = self._ask(m.ListGoals(), m.GoalList).goals
        return all(goal.status is Status.PAUSED for goal in goals if not goal.done)

    @property
    def jog_limitation(self) -> JogLimitation | None:
        return self._sample().limitation

    @property
    def faults(self) -> tuple[ArmFault, ...]:
        return tuple(map(fault_of, self._ask(m.GetFaults(), m.FaultList).faults))

    @property
    def warnings(self) -> tuple[ArmWarning, ...]:
        return warnings_of(self._ask(m.GetFaults(), m.FaultList))

    def fault_list(self) -> m.FaultList:
        """Return the faults with the stage of their handling, and the warnings."""
        return self._ask(m.GetFaults(), m.FaultList)

    def joint_reports(self) -> m.JointList:
        """Return identity, mode and counters of each joint.

        The counters are read from the joints while nothing moves, at most every 2 s; otherwise they
        are those that were read last.
        """
        return self._ask(m.GetJoints(), m.JointList)

    def overlay(self) -> m.ParametersState:
        """Return the file with the values in which this arm differs, and its revision."""
        return self._ask(m.GetParameters(), m.ParametersState)

    def set_overlay(self, text: str, revision: int) -> m.ParametersState:
        """Replace that file; its values apply from the next start of the owner.

        Args:
            text: Its new content, in YAML.
            revision: Number of the one that it replaces, from :meth:`overlay`.

        Raises:
            ConfigurationError: The owner has no such file, or the values cannot be used.
            ConflictError: Another client has replaced it since.
        """
        command = m.SetParameters(overlay=text, revision=revision)
        return self._command_for(command, m.ParametersState)

    def simulate_fault(self, fault: str, joint: str = "", value: float | None = None) -> None:
        self._ask(m.SimulateFault(fault, joint, value), m.Done)

    @property
    def simulation(self) -> RemoteSimulation:
        """The world around a simulated arm; also its faults that last, and its speed of time."""
        return self._simulation

    def set_real_time_factor(self, factor: float) -> None:
        """Let the time of a simulated arm pass faster or slower, also while it moves.

        Args:
            factor: Simulated time in a second of real time, 0.1 to 20.

        Raises:
            NotSupportedError: The arm is real, or simulated by another process.
            LimitError: The factor is outside its range.
        """
        self._command(m.SetRealTimeFactor(factor))

    @property
    def workspace(self) -> Workspace:
        state = self._ask(m.GetWorkspace(), m.WorkspaceState)
        if self._workspace is not None:
            known, workspace = self._workspace
            if (known.revision, known.widths) == (state.revision, state.widths):
                return workspace
        workspace = workspace_of(self.parameters, state)
        self._workspace = state, workspace
        return workspace

    @property
    def speed_override(self) -> float:
        return self._sample().speed_override

    @speed_override.setter
    def speed_override(self, share: float) -> None:
        self._command(m.SetSpeedOverride(number("speed_override", share)))

    def _set_scene(self, scene: Scene) -> None:
        self.do(m.SetScene(scene=scene_value(scene)))

    def _set_table(self, table: TeachTable) -> None:
        self.do(m.SetTable(table=table))

    def borrow_table(self, table: TeachTable) -> None:
        """Use another table until the owner ends or ``table`` is set; the owner's file stays.

        Args:
            table: The table.

        Raises:
            InvalidArgumentError: It is no table.
            BusyError: The arm moves.
        """
        if not isinstance(table, TeachTable):
            raise InvalidArgumentError(f"the table is {shown(table)}; give a TeachTable")
        self.do(m.SetTable(table=table, save=False))

    def stop(self) -> None:
        self._require_open()
        # First: what begins from now on is refused by this.
        self._lease.stops.note()
        self._link.stop()

    def cancel(self) -> None:
        self._lease.stops.note()
        if self._lease.held is not None:
            self._link.stop()

    @property
    def _stops(self) -> Stops:
        return self._lease.stops

    def pause(self) -> None:
        self._ask(m.Pause(), m.Done)

    def resume(self) -> None:
        try:
            self._ask(m.Resume(), m.Done)
        except LeaseError as error:
            if error.holder:
                raise
            self._lease.epoch()
            self._ask(m.Resume(), m.Done)

    def jog(
        self,
        velocities: Callable[[], Velocity | None],
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> RemoteOperation[None]:
        function("jog()", velocities)

        def stream(operation: RemoteOperation[None]) -> None:
            arguments = operation, velocities
            threading.Thread(
                target=self._stream, args=arguments, name="bioscara-jog", daemon=True
            ).start()

        return self._begin(m.Jog(), Conditions(timeout, on_cycle), wait=wait, begun=stream)

    def _stream(
        self, operation: RemoteOperation[None], velocities: Callable[[], Velocity | None]
    ) -> None:
        pause = threading.Event()
        try:
            while not operation.done:
                velocity = velocities()
                if velocity is None:
                    self._command(m.EndJog(operation.goal))
                    return
                velocity = require_velocity(velocity)
                if isinstance(velocity, JointVelocity):
                    self._command(m.SetJogVelocity(goal=operation.goal, joints=velocity))
                else:
                    self._command(m.SetJogVelocity(goal=operation.goal, tool=velocity))
                pause.wait(_JOG_PERIOD)
        except LeaseError:
            # The end of the lease has stopped the jog, whose end is an event.
            return
        except BaseException as error:  # noqa: BLE001  raised by result()
            if not operation.done:
                operation.interrupt(error)

    def _follow(
        self,
        trajectory: object,
        conditions: Conditions,
        *,
        approach: bool,
        planned: bool,
        wait: bool,
    ) -> RemoteOperation[None]:
        approach = flag("approach", approach)
        with self.one_call():
            task = self._follow_task(trajectory, approach=approach, planned=planned)
            return self._begin(task, conditions, wait=wait)

    def _follow_task(self, trajectory: object, *, approach: bool, planned: bool) -> m.Follow:
        """Return the task to follow a trajectory, whose first parts are uploaded before."""
        if not isinstance(trajectory, Trajectory):
            raise InvalidArgumentError(
                f"follow() takes a Trajectory, not a {type(trajectory).__name__}; execute() takes "
                "a Plan or a Trajectory"
            )
        self._require_open()
        *parts, last = trajectory_parts(trajectory)
        upload = 0
        for part in parts:
            command = m.AddPoints(points=part, upload=upload)
            answer = self._link.request(command, self._lease.epoch())
            if not isinstance(answer, m.PointsAdded):
                raise OwnerError(f"the owner answered {type(answer).__name__} to points")
            upload = answer.upload
        return m.Follow(last, approach, planned, upload)

    def do(
        self,
        task: m.AnyTask,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> RemoteOperation[Any]:
        require_task(task)
        return self._begin(task, Conditions(timeout, on_cycle), wait=wait)

    def _begin(
        self,
        task: m.AnyTask,
        conditions: Conditions,
        *,
        wait: bool,
        begun: Callable[[RemoteOperation[Any]], object] | None = None,
    ) -> RemoteOperation[Any]:
        """Begin a task, call ``begun``, and wait for its end if ``wait`` is set."""
        flag("wait", wait)
        timeout, on_cycle = conditions
        if on_cycle is not None:
            function("on_cycle", on_cycle)
        self._require_open()
        call = self._lease.stops.call()
        called(name := f"{task.call()}()")
        command = m.Start(task=task, timeout=timeout, records=on_cycle is not None)
        observed = wait or on_cycle is not None
        beginning = Beginning(lambda answer: self._operation(answer, on_cycle, observed=observed))
        try:
            try:
                self._request_start(command, call, name, beginning)
            except BioscaraError as error:
                refused(name, error)
                raise
            operation = beginning.operation
            if call.stopped:
                operation.cancel()
            with logged(operation, wait=wait):
                if begun is not None:
                    begun(operation)
                if wait:
                    operation.run()
                elif observed:
                    threading.Thread(
                        target=operation.observe, name="bioscara-records", daemon=True
                    ).start()
        except BaseException as error:
            beginning.interrupt(error)
            raise
        return operation

    def _request_start(self, command: m.Start, call: Call, name: str, beginning: Beginning) -> None:
        admit = partial(call.require, name)
        try:
            admit()
            epoch = self._lease.epoch()
            self._link.request(command, epoch, arrived=beginning.take, admit=admit)
        except LeaseError:
            # A stop of another client has ended the lease.
            admit()
            raise

    def _jaws(self) -> tuple[float, tuple[float, float]]:
        return self._sample().width, self.workspace.widths

    def _operation(
        self, answer: m.AnyResult, on_cycle: OnCycle | None, *, observed: bool
    ) -> RemoteOperation[Any]:
        if not isinstance(answer, m.Accepted):
            raise OwnerError(f"the owner answered {type(answer).__name__} to a goal")
        operation: RemoteOperation[Any] = RemoteOperation(
            self._link, self._lease, answer.goal, on_cycle, observed=observed
        )
        with self._registering:
            self._operations[operation.goal] = operation
            # Within the lock: messages that the link's thread reads next come after these.
            for message in self._early.pop(operation.goal, []):
                self._deliver(operation, message)
        return operation

    def _look_at_goals(self) -> None:
        """Ask how the operations are, after events were missed."""
        for operation in list(self._operations.values()):
            with suppress(BioscaraError):
                state = self._ask(m.GetGoal(operation.goal), m.GoalState)
                if state.goal.done:
                    operation.take(state.goal)
                    self._operations.pop(operation.goal, None)

    def _receive(self, message: m.FromOwner) -> None:
        """Take the messages that are no answers; called in the link's thread."""
        if isinstance(message, m.Event):
            self._lease.note(message)
            if message.what == "gap":
                # In a thread of its own, as this one reads the answers.
                threading.Thread(target=self._look_at_goals, daemon=True).start()
            if message.what != "goal_ended" or message.goal is None:
                return
            number = message.goal.goal
        elif isinstance(message, m.GoalCycle):
            number = message.goal
        else:
            if isinstance(message, m.ControllersSample):
                self.controllers.receive(message)
            elif isinstance(message, m.WorldSample):
                self._simulation.receive(message)
            return
        with self._registering:
            operation = self._operations.get(number)
            if operation is None:
                # Its handle is made when the answer to the request has been read.
                self._early.setdefault(number, []).append(message)
                while len(self._early) > _EARLY:
                    self._early.popitem(last=False)
                return
        self._deliver(operation, message)

    def _deliver(self, operation: RemoteOperation[Any], message: m.Event | m.GoalCycle) -> None:
        if isinstance(message, m.GoalCycle):
            operation.record(message.record)
        elif message.goal is not None:
            operation.take(message.goal)
            self._operations.pop(operation.goal, None)

    def _owner_lost(self, error: OwnerLostError) -> None:
        self._lease.lose(str(error))
        if not self._closed:
            # The next owner may have other parameters.
            self._description = self._workspace = None
            self._simulation = RemoteSimulation(self._ask, self._link.subscribe_to_world)
        with self._registering:
            lost = list(self._operations.values())
            self._operations.clear()
            self._early.clear()
        for operation in lost:
            operation.lose(error)
        if self._lost is not None and not self._closed:
            self._lost(error)

    def _require_open(self) -> None:
        self._link.maker.require()
        if self._closed:
            raise NotInitializedError("the robot was closed; make another one to connect again")
        if not self._opened:
            raise NotInitializedError(
                "the robot is not connected: open() it, or use it in a with statement"
            )

    def _described(self) -> m.Description:
        if self._description is None:
            self._require_open()
            self._description = self._ask(m.GetDescription(), m.Description)
        return self._description

    def _ask(self, command: m.AnyCommand, kind: type[R]) -> R:
        self._require_open()
        return _result(self._link.request(command), kind)

    def _command_for(self, command: m.AnyCommand, kind: type[R]) -> R:
        self._require_open()
        return _result(self._link.request(command, self._lease.epoch()), kind)

    def _command(self, command: m.AnyCommand) -> None:
        self._command_for(command, m.Done)

    def _sample(self) -> m.StateSample:
        return self._ask(m.GetState(), m.StateSample)

    def _positions(self, reason: str = "its position is unknown; home() first") -> Joints:
        states = self.state
        for name, position in zip(states.names, states.positions, strict=True):
            if math.isnan(position):
                self._require_clear()
                raise NotHomedError(f"{name} is not homed: {reason}", name)
        return Joints(*states.positions)

    def _require_clear(self) -> None:
        """Raise FaultedError if a fault is latched."""
        faults = self._ask(m.GetFaults(), m.FaultList)
        if faults.faults:
            first = faults.faults[0]
            error = FaultedError(refusal(faults.state, first.text))
            error.evidence = first.evidence
            raise error

    def _glance(self) -> Glance:
        if not self.is_open:
            return Glance(self._name, "closed")
        try:
            sample, told = self._sample(), self._ask(m.GetFaults(), m.FaultList)
        except BioscaraError as error:
            return Glance(self._name, str(error))
        fault = fault_of(told.faults[0]) if told.faults else None
        words = condition(fault, sample.moving, sample.pose, enabled=sample.enabled)
        states = None if sample.stale else _states(sample)
        return Glance(self._name, words, states, len(told.warnings))


def _timeout(given: float) -> float:
    timeout = number("timeout", given, infinite=True)
    if not timeout >= 0.0:
        raise InvalidArgumentError(f"timeout {timeout:g} s must not be below zero")
    return timeout


def _retried(
    attempt: Callable[[], object],
    refusal: type[BioscaraError],
    timeout: float,
    final: Callable[[], bool] = lambda: False,
) -> None:
    """Try something until it is not refused any more, for a time [s]; raise the last refusal.

    Args:
        attempt: The call.
        refusal: Errors after which it is tried again.
        timeout: The time.
        final: Returns whether a refusal is the last one before that.
    """
    end = time.monotonic() + timeout
    while True:
        try:
            attempt()
        except refusal:
            if time.monotonic() >= end or final():
                raise
            time.sleep(_RETRY)
        else:
            return


def _result(result: m.AnyResult, kind: type[R]) -> R:
    if not isinstance(result, kind):
        raise OwnerError(f"the owner answered {type(result).__name__}, not {kind.__name__}")
    return result


def _states(sample: m.StateSample) -> JointStates:
    return JointStates(
        sample.time,
        sample.names,
        sample.positions,
        sample.velocities,
        tuple(QUALITIES[quality] for quality in sample.qualities),
        sample.stamps,
    )
