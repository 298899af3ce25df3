"""Requests that concern the controllers of clients."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import Any, Protocol, TypeVar

from bioscara.api import messages as m
from bioscara.control.controllers.controller import AnyController
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.controllers.gripper_action_controller import GripperActionController
from bioscara.control.controllers.homing_controller import HomingController
from bioscara.control.controllers.joint_trajectory import (
    JointTrajectory,
    JointTrajectoryController,
    Point,
)
from bioscara.control.manager.diagnostics import Thresholds, diagnose
from bioscara.control.manager.introspection import introspect
from bioscara.control.manager.switch_request import Strictness, Switch
from bioscara.errors import (
    BioscaraError,
    ConfigurationError,
    GoalRejectedError,
    InvalidArgumentError,
    SwitchError,
)
from bioscara.hardware import LifecycleState
from bioscara.robot.connection.pacing import PacedClock
from bioscara.robot.operations.arbiter import ARM, GRIPPER
from bioscara.robot.operations.controllers.change_hardware_state import ChangeHardwareState
from bioscara.robot.operations.controllers.commands import send_gripper_goal, trigger_homing
from bioscara.robot.operations.controllers.planned_goal import PlannedGoal, can_be_planned
from bioscara.robot.operations.controllers.run_controllers import RunControllers, switch
from bioscara.robot.operations.controllers.unplanned_motion import slowed, streamed_point
from bioscara.robot.operations.operation import Operation
from bioscara.robot.runner import Runner
from bioscara.server.clients.client import Client, Later
from bioscara.server.controllers.controller_goals import ControllerGoals
from bioscara.server.controllers.loadable_controllers import LOADED, made_controller, require_client
from bioscara.server.controllers.loaders import Loaders
from bioscara.server.tasks.uploads import Uploads
from bioscara.spelling import did_you_mean

T = TypeVar("T")
C = TypeVar("C", bound=AnyController)

_PATIENCE = 15.0
"""Longest time that a request waits for work between cycles, or for the arm to come to rest [s]."""
_SWITCHING = "switching controllers"
"""Name of a switch in messages."""
_POINTS_MAX = 100_000
"""Largest number of points of a trajectory."""

Handler = Callable[[Client, Any, int], m.AnyResult | Later | None]
"""Carries out a command of a client with the epoch of its lease; returns None for Done."""


class Admission(Protocol):
    """How an owner admits operations of clients, and keeps them as goals."""

    def check(self, name: str, client: Client, epoch: int) -> Callable[[], None]:
        """Return a function that raises if the arm was stopped or the lease ended since."""

    def keep(self, operation: Operation[Any], client: Client, epoch: int) -> m.GoalValue:
        """Keep an operation that has begun as a goal, which ends with the lease."""

    def announce(self, what: m.EventKind, text: str, client: str) -> None:
        """Add an event."""


class ClientControllers:
    """Carries out requests that concern the controllers of clients.

    Attributes:
        goals: The goals of the controllers.
        handlers: The functions that handle the commands.
    """

    def __init__(self, runner: Runner, admission: Admission) -> None:
        self._runner, self._arm, self._admission = runner, runner.arm, admission
        self._run: RunControllers | None = None
        # One call at a time changes controllers or hardware, as in ros2_control.
        self._changing, self._jaws = threading.Lock(), threading.Lock()
        self._uploads = Uploads[tuple[Point, ...]](_POINTS_MAX, len)
        self._loaders = Loaders(admission.announce)
        self.goals = ControllerGoals()
        self.handlers: Mapping[type[m.Command], Handler] = {
            m.LoadController: self._load,
            m.ConfigureController: self._configure,
            m.CleanupController: self._cleanup,
            m.UnloadController: self._unload,
            m.SwitchControllers: self._switch,
            m.SetHardwareState: self._set_hardware_state,
            m.AddGoalPoints: lambda _, command, __: self._uploads.add(
                command.upload, command.points
            ),
            m.FollowGoal: self._follow,
            m.StreamTrajectory: self._stream,
            m.SendGripperGoal: self._move_gripper,
            m.TriggerHoming: self._trigger,
            m.CommandController: self._command,
            m.CancelControllerGoal: self._cancel,
            m.SetControllerScaling: self._set_scaling,
            m.SetControllerParameters: self._set_parameters,
            m.QueryController: self._query,
            m.GetIntrospection: self._introspect,
        }

    # Lifecycle.

    def _load(self, client: Client, command: m.LoadController, _: int) -> Later:
        stack = self._arm.stack
        former = self._loaders.former(client, command.name)

        def add(controller: AnyController) -> None:
            if former is not None:
                self._remove(controller.name)
            if len(stack.clients) >= LOADED:
                raise SwitchError(f"{LOADED} controllers are loaded; unload one that is not needed")
            stack.manager.add(controller)

        def work() -> None:
            given = command.name, command.type, command.parameters
            controller = made_controller(stack, *given)
            self._wait_for_rest()
            self._between(f"loading {controller.name}", lambda: add(controller))

        return Later(self._alone(work), lambda _: self._loaders.add(client, command.name, former))

    def _configure(self, client: Client, command: m.ConfigureController, _: int) -> Later:
        return self._change("configuring", client, command.name, self._arm.stack.manager.configure)

    def _cleanup(self, client: Client, command: m.CleanupController, _: int) -> Later:
        return self._change("cleaning up", client, command.name, self._arm.stack.manager.cleanup)

    def _unload(self, client: Client, command: m.UnloadController, _: int) -> Later:
        name = command.name
        work = self._change("unloading", client, name, self._arm.stack.manager.unload).work
        return Later(work, lambda _: self._loaders.remove(name))

    def _change(self, what: str, client: Client, name: str, change: Callable[[str], None]) -> Later:
        require_client(name)
        self._loaders.take(client, [name])
        return Later(
            self._alone(lambda: self._between(f"{what} a controller", lambda: change(name)))
        )

    def _remove(self, name: str) -> None:
        """Unload a controller of a client that has left, between two cycles."""
        manager = self._arm.stack.manager
        if manager.controller(name).state is LifecycleState.ACTIVE:
            # A lease that has lapsed stops only controllers that command something.
            self._switch_idle(((), [name], Strictness.STRICT))
        manager.unload(name)

    def _wait_for_rest(self) -> None:
        """Wait until the arm is at rest, if the operation of the controllers is being stopped."""
        run = self._run
        if run is not None and (run.claim.stopped or run.stopping):
            run.wait(_PATIENCE)

    def _switch(self, client: Client, command: m.SwitchControllers, epoch: int) -> Later:
        for name in (*command.activate, *command.deactivate):
            require_client(name)
        self._loaders.take(client, (*command.activate, *command.deactivate))
        check = self._admission.check(_SWITCHING, client, epoch)

        def finish(result: tuple[Switch | Exception, RunControllers | None]) -> m.Switched:
            switched, begun = result
            failed = isinstance(switched, Exception)
            if begun is not None and not (failed and begun.done):
                self._admission.keep(begun, client, epoch)
            if isinstance(switched, Exception):
                raise switched
            return m.Switched(switched.text)

        return Later(self._alone(lambda: self._switched(command, check)), finish)

    def _switched(
        self, command: m.SwitchControllers, check: Callable[[], None]
    ) -> tuple[Switch | Exception, RunControllers | None]:
        """Carry out a switch, in an operation if it needs one; return that if it was begun.

        The operation goes on after an error if some controllers were activated all the same.
        """
        strictness = Strictness.STRICT if command.strict else Strictness.BEST_EFFORT
        request = command.activate, command.deactivate, strictness
        # Controllers that are being stopped begin anew afterwards.
        self._wait_for_rest()
        run = self._run
        if run is not None and not run.done:
            with suppress(_EndedError):
                return self._between(_SWITCHING, partial(self._switch_in, run, request)), None
        if not any(map(self._commands, command.activate)):
            return self._between(_SWITCHING, partial(self._switch_idle, request)), None
        run = self._run = RunControllers(*request)
        self._runner.begin(run, check)
        try:
            return run.switched.result(_PATIENCE), run
        except TimeoutError:
            run.cancel()
            raise
        except BioscaraError as error:
            return error, run

    def _switch_in(self, run: RunControllers, request: Any) -> Switch:
        if run.done:
            raise _EndedError
        if run.claim.stopped:
            raise run.claim.refuse(_SWITCHING)
        return run.switch(self._arm, *request)

    def _switch_idle(self, request: Any) -> Switch:
        """Switch controllers that command nothing."""
        stack = self._arm.stack
        for name in request[0]:
            if self._commands(name):
                raise SwitchError(f"{name} was changed meanwhile; repeat the switch")
        return switch(stack, self._arm.session.clock.now(), *request)

    def _commands(self, name: str) -> bool:
        return any(
            each.name == name and each.state is LifecycleState.INACTIVE and each.command_interfaces
            for each in self._arm.stack.clients
        )

    def _set_hardware_state(self, client: Client, command: m.SetHardwareState, epoch: int) -> Later:
        stack = self._arm.stack
        states = {
            state.label: state for state in LifecycleState if state is not LifecycleState.UNKNOWN
        }
        if command.state not in states:
            hint = did_you_mean(command.state, states, f"there are {', '.join(states)}")
            raise InvalidArgumentError(f"there is no lifecycle state {command.state!r}; {hint}")
        known = [component.name for component in stack.manager.components]
        if command.component not in known:
            hint = did_you_mean(command.component, known, f"there are {', '.join(known)}")
            raise SwitchError(f"there is no hardware component {command.component!r}; {hint}")
        state = states[command.state]
        check = self._admission.check("setting a hardware state", client, epoch)
        used = ARM if command.component == stack.hardware.name else GRIPPER

        def work() -> LifecycleState:
            run = self._run
            claim = run is None or run.done
            operation = ChangeHardwareState(command.component, state, used, claim=claim)
            self._runner.begin(operation, check)
            return operation.result(_PATIENCE)

        return Later(
            self._alone(work), lambda result: m.HardwareState(command.component, result.label)
        )

    # Goals and commands.

    def _follow(self, _: Client, command: m.FollowGoal, __: int) -> Later:
        name = command.controller
        trajectory = self._completed(command.upload, command.goal.trajectory)
        goal = replace(command.goal, trajectory=trajectory, collision_checked=False)

        def work() -> int:
            arm, controller = self._arm, self._get(name, JointTrajectoryController)
            prepared = controller.prepare(goal)
            planned = can_be_planned(arm, controller, prepared)
            if not planned:
                slower, speed = slowed(arm, controller, goal.trajectory)
                prepared = controller.prepare(replace(goal, trajectory=slower), speed)

            def send() -> tuple[int, PlannedGoal | None]:
                run = self._require_running(name)
                controller = self._get(name, JointTrajectoryController)
                if not planned:
                    handle = controller.send_goal(prepared, arm.session.clock.now())
                    return self.goals.add(name, handle), None
                run.following = PlannedGoal(self._runner, controller, prepared)
                return self.goals.add(name, run.following.handle), run.following

            number, following = self._between(f"a goal for {name}", send)
            if following is not None:
                # The request is answered before the plan is made.
                threading.Thread(target=following.plan, name="bioscara-goal", daemon=True).start()
            return number

        return Later(work, m.ControllerGoal)

    def _completed(self, upload: int, last: JointTrajectory) -> JointTrajectory:
        """Return a trajectory with the points of an upload before its own."""
        return replace(last, points=(*chain(*self._uploads.completed(upload, last.points)),))

    def _stream(self, _: Client, command: m.StreamTrajectory, __: int) -> Later:
        name = command.controller
        trajectory = self._completed(command.upload, command.trajectory)

        def work() -> None:
            controller = self._get(name, JointTrajectoryController)
            prepared = controller.prepare_trajectory(trajectory)
            if (point := streamed_point(self._arm, controller, prepared)) is None:
                slower, speed = slowed(self._arm, controller, trajectory)
                prepared = controller.prepare_trajectory(slower, speed)

            def send() -> None:
                self._require_running(name)
                controller = self._get(name, JointTrajectoryController)
                now = self._arm.session.clock.now()
                if point is None:
                    controller.send_trajectory(prepared, now)
                else:
                    controller.send_point(prepared, point, now)

            self._between(f"a trajectory for {name}", send)

        return Later(work)

    def _move_gripper(self, _: Client, command: m.SendGripperGoal, __: int) -> Later:
        name = command.controller

        def work() -> int:
            with self._jaws:
                run = self._require_running(name)
                controller = self._get(name, GripperActionController)
                handle = send_gripper_goal(self._runner, run, controller, command.goal)
                return self._between(f"a goal for {name}", lambda: self.goals.add(name, handle))

        return Later(work, m.ControllerGoal)

    def _trigger(self, _: Client, command: m.TriggerHoming, __: int) -> Later:
        name = command.controller

        def send() -> None:
            run = self._require_running(name)
            controller = self._get(name, HomingController)
            handle = trigger_homing(self._arm, run, controller, command.joint, command.command)
            if handle is not None:
                self.goals.add(name, handle)

        return Later(lambda: self._between(f"homing by {name}", send))

    def _command(self, _: Client, command: m.CommandController, __: int) -> None:
        # At once, as it comes at the rate of the cycle: the controller takes it in its next one,
        # and one that is activated anew has forgotten it.
        self._require_running(command.controller)
        self._get(command.controller, ForwardCommandController).command(command.values)

    def _cancel(self, _: Client, command: m.CancelControllerGoal, __: int) -> Later:
        name = command.controller

        def cancel() -> None:
            handle = self.goals.running(name, command.goal)
            controller = self._loaded(name)
            if handle is None or handle.done:
                return
            if isinstance(controller, JointTrajectoryController):
                controller.cancel(self._arm.session.clock.now())
            elif isinstance(controller, GripperActionController | HomingController):
                controller.cancel()

        return Later(lambda: self._between(f"cancelling a goal of {name}", cancel))

    def _set_scaling(self, _: Client, command: m.SetControllerScaling, __: int) -> Later:
        name = command.controller

        def scale() -> None:
            run = self._require_running(name)
            run.set_scaling(self._get(name, JointTrajectoryController), command.factor)

        return Later(lambda: self._between(f"the scaling of {name}", scale))

    def _set_parameters(self, client: Client, command: m.SetControllerParameters, _: int) -> Later:
        name = command.controller
        self._loaders.take(client, [name])

        def work() -> None:
            controller = self._get(name, JointTrajectoryController, active=False)
            if controller.state not in (LifecycleState.INACTIVE, LifecycleState.ACTIVE):
                raise ConfigurationError(f"{name} is not configured; configure it first")
            parameters = controller.parameters.changed(name, command.parameters)
            self._between(f"the parameters of {name}", lambda: controller.change(parameters))

        return Later(self._alone(work))

    def _query(self, _: Client, command: m.QueryController, __: int) -> Later:
        name = command.controller

        def ask() -> m.DesiredState:
            controller = self._get(name, JointTrajectoryController)
            return m.DesiredState(
                controller.parameters.joints, controller.query_state(command.time)
            )

        return Later(lambda: self._between(f"a question to {name}", ask))

    def _introspect(self, _: Client, command: m.GetIntrospection, __: int) -> Later:
        stack, clock = self._arm.stack, self._arm.session.clock
        pace = clock.real_time_factor if isinstance(clock, PacedClock) else 1.0
        thresholds = Thresholds(stack.loop.rate, command.thresholds, pace)

        def ask() -> m.Introspection:
            return m.Introspection(
                introspect(stack.manager),
                tuple(
                    m.DiagnosticValue(each.name, int(each.level), each.message, dict(each.values))
                    for each in diagnose(stack.manager, stack.supervisor.faults, thresholds)
                ),
            )

        return Later(lambda: self._between("the introspection", ask))

    # Between cycles.

    def _between(self, name: str, work: Callable[[], T]) -> T:
        """Call a function between two cycles, in their thread; return its result."""
        return self._runner.between_cycles(name, work)

    def _alone(self, work: Callable[[], T]) -> Callable[[], T]:
        """Return a function that waits for the end of other changes first."""

        def alone() -> T:
            with self._changing:
                return work()

        return alone

    def _require_running(self, name: str) -> RunControllers:
        """Return the operation in which a controller may move the arm.

        Raises:
            FaultedError: A fault is latched.
            GoalRejectedError: There is none, or it is being stopped.
        """
        self._arm.stack.supervisor.require_clear()
        run = self._run
        if run is None or run.done:
            self._loaded(name)
            raise GoalRejectedError(f"{name} is not active: activate it first")
        if run.claim.stopped or run.stopping:
            raise GoalRejectedError(f"{name} is being stopped: activate it again afterwards")
        return run

    def _loaded(self, name: str) -> AnyController:
        require_client(name)
        return self._arm.stack.manager.controller(name)

    def _get(self, name: str, kind: type[C], *, active: bool = True) -> C:
        """Return a controller of a kind.

        Raises:
            SwitchError: There is none of that name, or it is the arm's own.
            GoalRejectedError: It is of another kind, or not active.
        """
        controller = self._loaded(name)
        if not isinstance(controller, kind):
            raise GoalRejectedError(f"{name} is a {controller.TYPE}, not a {kind.TYPE}")
        if active and controller.state is not LifecycleState.ACTIVE:
            raise GoalRejectedError(f"{name} is {controller.state.label}: activate it first")
        return controller


class _EndedError(Exception):
    """The operation of the controllers has ended before the request."""
