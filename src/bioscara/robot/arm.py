"""One arm with its control loop: operations are begun and stepped here, and nowhere else."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, nullcontext
from typing import Any, TypeVar

from bioscara.arguments import flag, number, whole
from bioscara.control.controllers.joint_state_broadcaster import JointStates
from bioscara.control.loop.loop import CycleReport
from bioscara.control.loop.realtime import realtime
from bioscara.errors import (
    BioscaraError,
    HardwareError,
    InvalidArgumentError,
    NotHomedError,
    NotInitializedError,
)
from bioscara.kinematics import Joints
from bioscara.planning.motions.elbow_side import ELBOW, bent
from bioscara.planning.motions.jog_limitation import JogLimitation
from bioscara.robot.connection import exit_guard
from bioscara.robot.connection.arm_session import ArmSession
from bioscara.robot.connection.pacing import PacedClock
from bioscara.robot.connection.stack import Stack
from bioscara.robot.operations.arbiter import Arbiter, Claim, Device
from bioscara.robot.operations.operation import Operation
from bioscara.robot.workspace.jaw_widths import JawWidths
from bioscara.robot.workspace.workspace import Workspace
from bioscara.scheduling import wake_on_time

T = TypeVar("T")

_SWITCH_INTERVAL = 0.0005
"""Time after which a Python thread that computes lets the loop's thread run [s]; usually 5 ms."""

_PATIENCE = 15.0
"""Time after which a stopped operation is at rest, or in a callback that may never return [s]."""
_ATTEMPTS = 3
"""Number of cycles in a row that fail, after which operations end without coming to rest: the
joints then stop themselves, as they receive nothing."""
_FASTEST = 1000.0
"""Largest factor between simulated and real time that is accepted."""
_POLL = 0.1
"""Polling period of a thread that waits for its turn, in case it is not notified [s]."""


class Arm:
    """Runs the operations of one arm, one at a time on each device, in one control loop.

    The loop runs in the thread that executes an operation, from its first cycle to its last; or,
    with :meth:`watch` or :meth:`run`, in one thread until the shutdown, so that faults are noticed
    while nothing moves. An operation does not depend on it.

    Args:
        session: Connection to the arm.
        workspace: Tool, scene, load and speed limit at first.
        pace_homing: Whether simulated homing is held back to real time.
        pace_motion: Whether simulated motion is held back to real time.

    Attributes:
        session: As given.
        arbiter: Admits one operation to each device.
        jaws: The widths that the gripper's jaws may have.
        bent_elbow: Position of j3 when the elbow was bent last, to either side [rad]; None if it
            was not yet.
        observers: Called at the end of each control cycle, in the thread that runs it; must return
            at once and raise nothing.
    """

    def __init__(
        self,
        session: ArmSession,
        workspace: Workspace,
        *,
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> None:
        self.session, self._workspace = session, workspace
        self.jaws = JawWidths(session.gripper, session.parameters.gripper)
        self.arbiter = Arbiter()
        self.bent_elbow: float | None = None
        self._pauses: dict[str, str] = {}
        self.observers: tuple[Callable[[CycleReport], object], ...] = ()
        self._pace_homing = flag("pace_homing", pace_homing)
        self._pace_motion = flag("pace_motion", pace_motion)
        self._speed_override = 1.0
        self._operations: tuple[Operation[Any], ...] = ()
        self._beginning, self._turn = threading.Lock(), threading.Condition()
        self._stepper: threading.Thread | None = None
        self._runner: threading.Thread | None = None
        self._watched = False
        self._failures = 0
        self._priority: int | None = None
        self._arranging = threading.Lock()

    @property
    def stack(self) -> Stack:
        """The control stack.

        Raises:
            NotInitializedError: The arm is not connected.
        """
        return self.session.stack

    @property
    def operations(self) -> tuple[Operation[Any], ...]:
        """The operations that were admitted and have not ended."""
        running = self.arbiter.running
        return tuple([each for each in self._operations if each.claim in running])

    @property
    def limitation(self) -> JogLimitation | None:
        """Why the running jog does not fully follow its velocity; None if it does or none runs."""
        return next((each.limitation for each in self.operations if each.limitation), None)

    @property
    def workspace(self) -> Workspace:
        """Tool, scene, load, speed limit and the widths that the jaws may have now."""
        # Another thread may replace the workspace at the same time: that must not be undone.
        with self._arranging:
            self._workspace = self._workspace.with_widths(*self.jaws.range())
            return self._workspace

    def use_workspace(self, workspace: Workspace) -> None:
        """Replace the workspace, for plans, jogs and limits; only within an operation."""
        with self._arranging:
            self._workspace = workspace
        if self.session.connected:
            self.stack.use_workspace(workspace)

    @property
    def speed_override(self) -> float:
        """Share of the planned or jog speed, 0 to 1; any thread may change it, 0 pauses."""
        return self._speed_override

    @speed_override.setter
    def speed_override(self, share: float) -> None:
        share = number("speed_override", share)
        if not 0.0 <= share <= 1.0:
            raise InvalidArgumentError(
                f"speed_override {share:g} is outside 0 .. 1: it is a share of the planned speed"
            )
        self._speed_override = share

    @property
    def paused(self) -> bool:
        """Whether all motions are paused."""
        return bool(self._pauses)

    @property
    def pauses(self) -> dict[str, str]:
        """Name of the author of each pause of all motions, by the author's key; oldest first."""
        return self._pauses.copy()

    def pause(self, author: str = "", name: str = "this program") -> None:
        """Pause all motions until :meth:`resume` of the same author, from any thread.

        Args:
            author: Key of who pauses; by default the program that has the arm.
            name: Name of the author, for messages to people.
        """
        self.session.maker.require()
        # One step of the interpreter, as the methods below: a signal handler may call it.
        self._pauses[author] = name

    def resume(self, author: str = "") -> None:
        """End the pause of an author; motions continue when none is left."""
        self._pauses.pop(author, None)

    def speed_of(self, operation: Operation[Any]) -> float:
        """Return the share of the planned speed at which an operation moves now."""
        return 0.0 if self.paused or operation.paused else self._speed_override

    @property
    def resumption(self) -> str:
        """What ends a pause, with the names of other programs that paused."""
        others = [name for author, name in self.pauses.items() if author]
        return f"resume() (paused by {', '.join(others)})" if others else "resume()"

    def pause_remedy(self, operation: Operation[Any]) -> str | None:
        """Return what ends the pause of an operation; None if it is not paused."""
        if self.paused or operation.paused:
            return self.resumption
        return "a speed_override above 0" if self._speed_override == 0.0 else None

    def pace(self, *, homing: bool) -> None:
        """Hold simulated time back to real time, or not, as chosen for homing and for motion."""
        clock = self.session.clock
        if isinstance(clock, PacedClock):
            clock.paced = self._pace_homing if homing else self._pace_motion

    def states(self) -> JointStates:
        """Return the joint states: of the last cycle while the loop runs, else read now.

        Raises:
            BusyError: The loop runs and has not read the joints yet.
            FaultedError: The joints were released because of a fault, and are not recovered.
            BioscaraError: They were released without a fault.
        """
        stack = self.stack
        with self._turn:
            stepped = self._stepper is not None
            if not stepped:
                states, now = stack.broadcaster.states, self.session.clock.now()
                if states is None or now - states.time > 2.0 * stack.loop.period:
                    stack.cycle()
        states = stack.broadcaster.states
        if states is None:
            if stepped and (running := self.arbiter.running):
                raise running[0].refuse("state")
            stack.supervisor.require_clear()
            raise BioscaraError("the joints are released and report no state; enable() them")
        return states

    def positions(self, reason: str = "its position is unknown; home() first") -> Joints:
        """Return the joint positions [rad, m, rad, rad].

        Args:
            reason: Why a joint that is not homed is refused, for the message.

        Raises:
            FaultedError: The position of a joint is unknown, and a fault is latched.
            NotHomedError: The position of a joint is unknown.
            BioscaraError: As :meth:`states`.
        """
        states = self.states()
        for name, position in zip(states.names, states.positions, strict=True):
            if math.isnan(position):
                # A joint that restarted is homed again once the fault is recovered from.
                self.stack.supervisor.require_clear()
                raise NotHomedError(f"{name} is not homed: {reason}", name)
        return Joints(*states.positions)

    def begin(self, operation: Operation[Any], admit: Callable[[], object] | None = None) -> None:
        """Claim the devices of an operation and prepare it; :meth:`step` then advances it.

        Args:
            operation: The operation.
            admit: Called once its devices are claimed; raises to refuse it.

        Raises:
            BusyError: Another operation uses one of the devices, or this is called from a callback
                of an operation.
            BioscaraError: The operation is refused; nothing moves.
        """
        self.require_outside(operation.name)
        try:
            # Not the turn, which may be taken: a stop from now on must reach the operation.
            with self._beginning:
                self._operations = (*self._operations, operation)
            operation.begin(self, admit)
        except BaseException as error:
            if not isinstance(error, Exception) and not operation.prepared:
                operation.abandon(error)
            self._forget_ended()
            raise

    def execute(self, operation: Operation[T]) -> T:
        """Begin an operation and return its result at its end.

        An exception that interrupts the call, such as KeyboardInterrupt, is raised once the devices
        are at rest.

        Raises:
            BusyError: As :meth:`begin`.
            BioscaraError: The operation was refused, or the error that ended it.
        """
        me, ending = threading.current_thread(), None
        try:
            self.begin(operation)
        except BaseException as error:
            if not _interrupted_after_begin(operation, error):
                raise
            ending = error
            operation.interrupt(error)
        # No call: a KeyboardInterrupt at its begin would leave the operation to itself.
        while not operation.claim.ended:
            try:
                # Signals that repeat faster than a late computer ends a cycle would keep setpoints
                # from the joints while they come to rest.
                with nullcontext() if ending is None else exit_guard.postponed():
                    self._take_turn(operation)
                    while not operation.done:
                        self.step()
            except BaseException as error:  # noqa: BLE001  raised below
                self._interrupt((operation,), error)
                if not isinstance(error, Exception):
                    ending = error
            finally:
                # Before any call: a KeyboardInterrupt at its begin would keep the turn.
                if self._stepper is me:
                    self._stepper = None
                self._notify()
        self._forget_ended()
        if ending is not None:
            # The operation may have ended just before this request to end the program.
            raise ending
        return operation.result()

    def start(self, operation: Operation[Any]) -> None:
        """Begin an operation, and step it in a thread of its own or in that of :meth:`watch`.

        Raises:
            BusyError: As :meth:`begin`.
            BioscaraError: The operation is refused; nothing moves.
        """
        try:
            self.begin(operation)
            self._ensure_runner()
        except BaseException as error:
            if _interrupted_after_begin(operation, error):
                operation.interrupt(error)
                self._ensure_runner()
            raise

    @property
    def watched(self) -> bool:
        """Whether the control loop runs, and goes on until the shutdown."""
        return self._watched

    def watch(self, *, priority: int | None = None, real_time_factor: float = 1.0) -> None:
        """Run the control loop in a thread of its own, in real time, until the shutdown.

        Args:
            priority: Real-time priority of the thread, 1 to 99; None for none.
            real_time_factor: Factor by which simulated time is faster than real time.

        Raises:
            NotInitializedError: The arm is not connected.
            InvalidArgumentError: The factor is not above zero, the time is not simulated, or the
                priority is outside its range.
            RealtimeError: The system does not permit the priority.
        """
        stack = self.stack
        factor, clock = number("real_time_factor", real_time_factor), self.session.clock
        if priority is not None:
            # Here too: an error in the thread of the loop would end the loop without a message.
            with realtime(priority := whole("priority", priority)):
                pass
        if not 0.0 < factor <= _FASTEST:
            raise InvalidArgumentError(f"real_time_factor {factor:g} is outside 0 .. {_FASTEST:g}")
        if isinstance(clock, PacedClock):
            clock.real_time_factor = factor
        elif factor != 1.0:
            raise InvalidArgumentError(
                f"real_time_factor {factor:g}: only the arm simulated in this process can be "
                "faster than real time"
            )
        self._pace_homing = self._pace_motion = self._watched = True
        self._priority = priority
        self.pace(homing=False)
        stack.manager.statistics.forget()
        for controller in stack.manager.controllers:
            controller.statistics.forget()
        self._ensure_runner()

    def run(self, ended: Callable[[], bool]) -> None:
        """Run the control loop in this thread, also while nothing moves.

        Args:
            ended: Called each cycle; returns whether to return once no operation is left.
        """
        me = threading.current_thread()
        try:
            self._take_turn()
            # A thread for one operation may begin after that was ended by a shutdown.
            if self.session.connected:
                self.stack.loop.restart()
            while self._operations or not ended():
                try:
                    self.step(idle=True)
                except BaseException as error:
                    if not self._operations:
                        raise
                    self._interrupt(self._operations, error)
        finally:
            if self._stepper is me:
                self._stepper = None
            self._notify()

    def step(self, *, idle: bool = False) -> None:
        """Advance all operations and run the control cycle that they need.

        Called by the thread that runs the loop.

        Args:
            idle: Whether to run a cycle even if no operation needs one.
        """
        ended = False
        for operation in self._operations:
            operation.step()
            ended = ended or operation.done
        if ended:
            self._forget_ended()
        if self._operations or idle:
            cycle = self.stack.loop.step(self._stop_at_last)
            self._failures = 0
            self._watch_elbow()
            for operation in self._operations:
                operation.observe(cycle)
            for observer in self.observers:
                observer(cycle)

    def _watch_elbow(self) -> None:
        """Note to which side the elbow is bent."""
        states = self.stack.broadcaster.states
        if states is not None and bent(elbow := states.positions[ELBOW]):
            self.bent_elbow = elbow

    def _interrupt(self, operations: Sequence[Operation[Any]], error: BaseException) -> None:
        """Bring operations to rest after a cycle that raised, or end them if all cycles raise."""
        # Requests to end the program may come in a row, and cycles after them succeed.
        self._failures += isinstance(error, Exception)
        for operation in operations:
            if self._failures < _ATTEMPTS:
                operation.interrupt(error)
            else:
                operation.abandon(error)

    def _stop_at_last(self) -> None:
        """Step the operations that were stopped while the loop waited for its deadline."""
        for operation in self._operations:
            if operation.stop_unseen:
                operation.step()

    def restart_loop(self, operation: Operation[Any]) -> None:
        """Begin the cycles anew after a time without them, unless the arm is moving.

        Args:
            operation: The operation that took that time; another operation may move the arm.
        """
        # One that is refused because of this operation, or has just ended, moves nothing.
        others = [each for each in self.operations if each is not operation]
        if not any(Device.ARM in other.devices for other in others):
            self.stack.loop.restart()

    @property
    def in_callback(self) -> bool:
        """Whether this thread runs the loop, as in a callback of an operation."""
        return self._stepper is threading.current_thread()

    def require_outside(self, name: str) -> None:
        """Raise in the thread that runs the loop, which would wait for itself.

        Args:
            name: Name of the call that is made in a callback.

        Raises:
            BusyError: This thread runs the loop.
            NotInitializedError: The arm belongs to a parent process, where the loop runs.
        """
        self.session.maker.require()
        if self.in_callback:
            running = self.arbiter.running or (Claim("the control loop"),)
            raise running[0].refuse(name, inside=True)

    def stop(self) -> None:
        """Stop all operations and end all pauses, from any thread; returns at once.

        Raises:
            NotInitializedError: The arm belongs to a parent process.
        """
        self.session.maker.require()
        self.arbiter.stop()
        self._pauses.clear()

    def connect(self) -> None:
        """Open the bus, connect to the joints and run the first control cycle; nothing moves.

        Raises:
            LifecycleError: The arm is connected, or was shut down.
            BioscaraError: A joint cannot be used; the bus is closed again.
            MotionCancelledError: It was stopped; the arm is connected.
        """
        self.session.maker.require()
        with self.arbiter.claimed("connecting"):
            # First: the turn of an arm that is watched never ends.
            self.session.require_unconnected()
            me = threading.current_thread()
            try:
                self._take_turn()
                self.session.connect(self.workspace)
            finally:
                if self._stepper is me:
                    self._stepper = None
                self._notify()

    def shutdown(self) -> list[str]:
        """Stop all operations, wait for their ends, and disable all joints.

        Does nothing if that is done already.

        Returns:
            A sentence for each joint that could not be stopped or disabled.

        Raises:
            BusyError: Called from a callback of an operation that it would have to wait for.
        """
        self.require_outside("shutdown()")
        with self.arbiter.seized("shutdown()"):
            self._watched = False
            me = threading.current_thread()
            try:
                self._take_turn()
                problems = self.session.shutdown()
                # One without devices may have begun since the last cycle: its thread waits for it.
                for operation in self._operations:
                    operation.abandon(
                        NotInitializedError(f"{operation.name}: the arm was shut down")
                    )
                return problems
            finally:
                if self._stepper is me:
                    self._stepper = None
                self._forget_ended()

    def close(self, error: BaseException | None) -> None:
        """Shut down despite interruptions, and close the bus.

        Args:
            error: The exception that is being raised, if any; it gets the problems as a note.

        Raises:
            HardwareError: A joint could not be stopped or disabled, and there is no ``error``.
            KeyboardInterrupt, SystemExit: It was interrupted; the joints are disabled, unless an
                operation did not end within 15 s.
        """
        if self.session.maker.left:
            return
        problems, raised, begin = "", error, time.monotonic()
        # While shutdown is refused, an operation is still using the bus, which stays open.
        while self.session.connected:
            try:
                problems = "; ".join(self.shutdown())
            except (KeyboardInterrupt, SystemExit) as interrupt:
                if self.arbiter.running and time.monotonic() - begin >= _PATIENCE:
                    raise
                raised = interrupt
        self.session.bus.close()
        if problems and raised is None:
            raise HardwareError(problems)
        if problems and raised is not None:
            raised.add_note(problems)
        if raised is not None and raised is not error:
            raise raised

    def _take_turn(self, operation: Operation[Any] | None = None) -> None:
        """Wait until no other thread runs the loop or reads the joints, or the operation ended."""
        me = threading.current_thread()
        with self._turn:
            while self._stepper not in {None, me}:
                if operation is not None and operation.done:
                    return
                self._turn.wait(_POLL)
            self._stepper = me
        wake_on_time()

    def _notify(self) -> None:
        """Wake the threads that wait for the turn or for the end of an operation."""
        with self._turn:
            self._turn.notify_all()

    def _forget_ended(self) -> None:
        with self._beginning:
            self._operations = tuple([each for each in self._operations if not each.done])
        self._notify()

    def _ensure_runner(self) -> None:
        with self._turn:
            if self._runner is None:
                self._runner = threading.Thread(
                    target=self._run_in_thread, name="bioscara-arm", daemon=True
                )
                self._runner.start()

    def _run_in_thread(self) -> None:
        # Of the interpreter: other threads of the program then delay the loop less.
        sys.setswitchinterval(min(sys.getswitchinterval(), _SWITCH_INTERVAL))
        while True:
            try:
                with ExitStack() as conditions:
                    if self._priority is not None:
                        conditions.enter_context(realtime(self._priority))
                    self.run(lambda: not self._watched)
            except BaseException:
                if not self._operations:
                    # The next operation needs another thread.
                    self._watched = False
                    raise
            finally:
                with self._turn:
                    ended = not self._operations and not self._watched
                    if ended:
                        self._runner = None
            if ended:
                return


def _interrupted_after_begin(operation: Operation[Any], error: BaseException) -> bool:
    """Return whether a request to end the program came when the operation had just begun."""
    return not isinstance(error, Exception) and operation.prepared and not operation.claim.ended
