"""The control loop of an arm: operations are begun and stepped here, and nowhere else."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, nullcontext
from typing import Any, TypeVar

from bioscara.arguments import number, whole
from bioscara.control.loop.loop import CycleReport
from bioscara.control.loop.realtime import realtime
from bioscara.errors import HardwareError, InvalidArgumentError, NotInitializedError
from bioscara.planning.motions.elbow_side import ELBOW, bent
from bioscara.planning.motions.jog_limitation import JogLimitation
from bioscara.robot.arm import Arm
from bioscara.robot.connection import exit_guard
from bioscara.robot.connection.pacing import PacedClock
from bioscara.robot.operations.between_cycles import BetweenCycles
from bioscara.robot.operations.operation import Operation

T = TypeVar("T")

_SWITCH_INTERVAL = 0.0005
"""Time after which a Python thread that computes lets the loop's thread run [s]; usually 5 ms."""

_PATIENCE = 15.0
"""Time after which a stopped operation is at rest, or in a callback that may never return; and the
longest time that a thread waits for its turn between cycles [s]."""
_ATTEMPTS = 3
"""Number of cycles in a row that fail, after which operations end without coming to rest: the
joints then stop themselves, as they receive nothing."""
_FASTEST = 1000.0
"""Largest factor between simulated and real time that is accepted."""


class Runner:
    """Runs the operations of one arm, one at a time on each device, in one control loop.

    The loop runs in the thread that executes an operation, from its first cycle to its last; or,
    with :meth:`watch` or :meth:`run`, in one thread until the shutdown, so that faults are noticed
    while nothing moves. An operation does not depend on it.

    Args:
        arm: The arm.

    Attributes:
        arm: As given.
        observers: Called at the end of each control cycle, in the thread that runs it; must return
            at once and raise nothing.
    """

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.observers: tuple[Callable[[CycleReport], object], ...] = ()
        self._operations: tuple[Operation[Any], ...] = ()
        self._beginning = threading.Lock()
        self._thread: threading.Thread | None = None
        self._watched = False
        self._failures = 0
        self._priority: int | None = None

    @property
    def limitation(self) -> JogLimitation | None:
        """Why the running jog does not fully follow its velocity; None if it does or none runs."""
        return next((each.limitation for each in self._operations if each.limitation), None)

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
        self.arm.require_outside(operation.name)
        try:
            # Not the turn, which may be taken: a stop from now on must reach the operation.
            with self._beginning:
                self._operations = (*self._operations, operation)
                self.arm.begun = self._operations
            operation.begin(self.arm, admit)
        except BaseException as error:
            if not isinstance(error, Exception) and not operation.prepared:
                operation.abandon(error)
            self._forget_ended()
            raise

    def execute(self, operation: Operation[T], admit: Callable[[], object] | None = None) -> T:
        """Begin an operation and return its result at its end.

        An exception that interrupts the call, such as KeyboardInterrupt, is raised once the devices
        are at rest.

        Args:
            operation: The operation.
            admit: As for :meth:`begin`.

        Raises:
            BusyError: As :meth:`begin`.
            BioscaraError: The operation was refused, or the error that ended it.
        """
        me, turn, ending = threading.current_thread(), self.arm.turn, None
        try:
            self.begin(operation, admit)
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
                    turn.take(lambda: operation.done)
                    while not operation.done:
                        self.step()
            except BaseException as error:  # noqa: BLE001  raised below
                self._interrupt((operation,), error)
                if not isinstance(error, Exception):
                    ending = error
            finally:
                # Before any call: a KeyboardInterrupt at its begin would keep the turn.
                if turn.holder is me:
                    turn.holder = None
                turn.notify()
        self._forget_ended()
        if ending is not None:
            # The operation may have ended just before this request to end the program.
            raise ending
        return operation.result()

    def between_cycles(self, name: str, work: Callable[[], T]) -> T:
        """Call a function between two cycles, in their thread; return its result.

        Args:
            name: Name of the work in messages.
            work: The function; it uses no device.
        """
        operation = BetweenCycles(name, lambda _: work(), frozenset())
        self.begin(operation)
        return operation.result(_PATIENCE)

    def aside(self, name: str, work: Callable[[], T]) -> T:
        """Call a function between two cycles, from any thread, whether the loop runs or not.

        Args:
            name: Name of the work in messages.
            work: The function; it uses no device.

        Raises:
            NotInitializedError: The robot is not connected.
        """
        if self.arm.turn.mine:
            return work()
        return self.execute(BetweenCycles(name, lambda _: work(), frozenset()))

    def start(self, operation: Operation[Any], admit: Callable[[], object] | None = None) -> None:
        """Begin an operation, and step it in a thread of its own or in that of :meth:`watch`.

        Args:
            operation: The operation.
            admit: As for :meth:`begin`.

        Raises:
            BusyError: As :meth:`begin`.
            BioscaraError: The operation is refused; nothing moves.
        """
        try:
            self.begin(operation, admit)
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
        stack = self.arm.stack
        factor, clock = number("real_time_factor", real_time_factor), self.arm.session.clock
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
        self.arm.pace_homing = self.arm.pace_motion = self._watched = True
        self._priority = priority
        self.arm.pace(homing=False)
        stack.manager.statistics.forget()
        for controller in stack.manager.controllers:
            controller.statistics.forget()
        self._ensure_runner()

    def run(self, ended: Callable[[], bool]) -> None:
        """Run the control loop in this thread, also while nothing moves.

        Args:
            ended: Called each cycle; returns whether to return once no operation is left.
        """
        me, turn = threading.current_thread(), self.arm.turn
        try:
            turn.take()
            # A thread for one operation may begin after that was ended by a shutdown.
            if self.arm.session.connected:
                self.arm.stack.loop.restart()
            while self._operations or not ended():
                try:
                    self.step(idle=True)
                except BaseException as error:
                    if not self._operations:
                        raise
                    self._interrupt(self._operations, error)
        finally:
            if turn.holder is me:
                turn.holder = None
            turn.notify()

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
            cycle = self.arm.stack.loop.step(self._stop_at_last)
            self._failures = 0
            self._watch_elbow()
            for operation in self._operations:
                operation.observe(cycle)
            for observer in self.observers:
                observer(cycle)

    def _watch_elbow(self) -> None:
        """Note to which side the elbow is bent."""
        states = self.arm.stack.broadcaster.states
        if states is not None and bent(elbow := states.positions[ELBOW]):
            self.arm.bent_elbow = elbow

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

    def connect(self) -> None:
        """Open the bus, connect to the joints and run the first control cycle; nothing moves.

        Raises:
            LifecycleError: The arm is connected, or was shut down.
            BioscaraError: A joint cannot be used; the bus is closed again.
            MotionCancelledError: It was stopped; the arm is connected.
        """
        self.arm.session.maker.require()
        with self.arm.arbiter.claimed("connecting"):
            # First: the turn of an arm that is watched never ends.
            self.arm.session.require_unconnected()
            me, turn = threading.current_thread(), self.arm.turn
            try:
                turn.take()
                self.arm.session.connect(self.arm.workspace)
                self.arm.stack.supervisor.calls = lambda: self.arm.calls
            finally:
                if turn.holder is me:
                    turn.holder = None
                turn.notify()

    def shutdown(self) -> list[str]:
        """Stop all operations, wait for their ends, and disable all joints.

        Does nothing if that is done already.

        Returns:
            A sentence for each joint that could not be stopped or disabled.

        Raises:
            BusyError: Called from a callback of an operation that it would have to wait for.
        """
        self.arm.require_outside("shutdown()")
        with self.arm.arbiter.seized("shutdown()"):
            self._watched = False
            me, turn = threading.current_thread(), self.arm.turn
            try:
                turn.take()
                problems = self.arm.session.shutdown()
                # One without devices may have begun since the last cycle: its thread waits for it.
                for operation in self._operations:
                    operation.abandon(
                        NotInitializedError(f"{operation.name}: the arm was shut down")
                    )
                return problems
            finally:
                if turn.holder is me:
                    turn.holder = None
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
        if self.arm.session.maker.left:
            return
        problems, raised, begin = "", error, time.monotonic()
        # While shutdown is refused, an operation is still using the bus, which stays open.
        while self.arm.session.connected:
            try:
                problems = "; ".join(self.shutdown())
            except (KeyboardInterrupt, SystemExit) as interrupt:
                if self.arm.arbiter.running and time.monotonic() - begin >= _PATIENCE:
                    raise
                raised = interrupt
        self.arm.session.bus.close()
        if problems and raised is None:
            raise HardwareError(problems)
        if problems and raised is not None:
            raised.add_note(problems)
        if raised is not None and raised is not error:
            raise raised

    def _forget_ended(self) -> None:
        with self._beginning:
            self._operations = tuple([each for each in self._operations if not each.done])
            self.arm.begun = self._operations
        self.arm.turn.notify()

    def _ensure_runner(self) -> None:
        with self.arm.turn.changed:
            if self._thread is None:
                self._thread = threading.Thread(
                    target=self._run_in_thread, name="bioscara-arm", daemon=True
                )
                self._thread.start()

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
                with self.arm.turn.changed:
                    ended = not self._operations and not self._watched
                    if ended:
                        self._thread = None
            if ended:
                return


def _interrupted_after_begin(operation: Operation[Any], error: BaseException) -> bool:
    """Return whether a request to end the program came when the operation had just begun."""
    return not isinstance(error, Exception) and operation.prepared and not operation.claim.ended
