"""Operations of an arm: begun on request, then stepped once a control cycle until they end."""

from __future__ import annotations

import asyncio
import math
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator
from contextlib import suppress
from enum import Enum
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from bioscara.arguments import function, number
from bioscara.control.loop.loop import CycleReport
from bioscara.errors import (
    InvalidArgumentError,
    LifecycleError,
    MotionCancelledError,
    MotionTimeoutError,
    NotSupportedError,
)
from bioscara.planning.motions.jog_limitation import JogLimitation
from bioscara.report import CycleRecord, Phase
from bioscara.robot.operations.arbiter import ARM, Claim, Device
from bioscara.robot.operations.cycle_recorder import CycleRecorder

if TYPE_CHECKING:
    from bioscara.robot.arm import Arm

T = TypeVar("T")

OnCycle = Callable[[CycleRecord], object]
"""Receives the record of each cycle at its end; must return at once."""


class Cycle(NamedTuple):
    """A control cycle that an operation needs.

    Attributes:
        phase: Phase that its record has.
        zero: Time at which the trajectory began or will begin [s]; NaN if there is none.
    """

    phase: Phase
    zero: float = math.nan


Cycles = Generator[Cycle | None, None, T]
"""Runs up to each control cycle that it needs, yields it, and returns the result at its end. None
is a cycle of which no record is kept."""


class Status(Enum):
    """Stage of an operation."""

    WAITING = "waiting"
    """Not begun, or not stepped yet."""
    RUNNING = "running"
    PAUSED = "paused"
    STOPPING = "stopping"
    SUCCEEDED = "succeeded"
    CANCELLED = "cancelled"
    FAILED = "failed"


class Operation(ABC, Generic[T]):
    """Something that an arm does; the handle of a motion that was begun without waiting.

    :meth:`begin` claims its devices and prepares it in the calling thread, as planning may take
    longer than a cycle; :meth:`step` is called by the control loop before each cycle. However it
    ends, the devices are at rest before the end is reported. An operation is used once.

    Args:
        name: Name for messages, such as ``"home()"``.
        timeout: Longest duration from its first cycle [s]; None for no limit.
        on_cycle: Receives the record of each cycle; None for no records.

    Attributes:
        name: As given.
        claim: Its claim to the devices.
        error: Why it ended early; None otherwise.
        limitation: Why a jog does not fully follow its velocity: its joints, its surroundings, the
            speed limit or the end of its reach. None if it does, at rest and for other operations.
            After the end, as it was when the velocities ended.

    Raises:
        InvalidArgumentError: The timeout is not above zero, or ``on_cycle`` cannot be called.
    """

    devices: frozenset[Device] = ARM
    _needs_confirmed_scene = False
    """Whether it moves something by itself, and not by a person's hand as a jog."""

    def __init__(
        self, name: str, *, timeout: float | None = None, on_cycle: OnCycle | None = None
    ) -> None:
        self.name = name
        self.claim = Claim(name, self.devices)
        self.timeout = math.inf if timeout is None else number("timeout", timeout, infinite=True)
        if not self.timeout > 0.0:
            raise InvalidArgumentError(f"timeout {self.timeout:g} s must be above zero")
        if on_cycle is not None:
            function("on_cycle", on_cycle)
        self.error: BaseException | None = None
        self.limitation: JogLimitation | None = None
        self._on_cycle = on_cycle
        self._recorder: CycleRecorder | None = None
        self._interruption: BaseException | None = None
        self._procedure: Cycles[T] | None = None
        self._cycle: Cycle | None = None
        self._result: T | None = None
        self._begun = self._paused = self._stop_seen = False
        self._arm: Arm | None = None
        self._finished = threading.Event()
        self._callbacks: list[Callable[[], object]] = []

    def prepare(self, arm: Arm) -> None:
        """Plan, and do other work that may take longer than a cycle; nothing moves.

        Called by :meth:`begin`, in the thread of the caller.
        """

    @abstractmethod
    def cycles(self, arm: Arm) -> Cycles[T]:
        """Run the operation up to each control cycle that it needs; return its result."""

    def begin(self, arm: Arm, admit: Callable[[], object] | None = None) -> None:
        """Claim the devices and prepare the operation; nothing moves yet.

        Args:
            arm: The arm.
            admit: Called once the devices are claimed, when no stop can be missed any more; raises
                to refuse the operation.

        Raises:
            BusyError: Another operation uses one of the devices.
            LifecycleError: It was begun before.
            BioscaraError: It is refused; nothing moves.
        """
        if self._begun:
            raise LifecycleError(f"{self.name} was begun already; each motion is a new operation")
        try:
            self._begun, self._arm = True, arm
            self.claim = Claim(self.name, self.devices)
            arm.arbiter.take(self.claim)
            if admit is not None:
                admit()
            if self._needs_confirmed_scene:
                arm.workspace.require_confirmed(self.name)
            self.prepare(arm)
            if self._on_cycle is not None:
                self._recorder = CycleRecorder(arm.stack, arm.session.begin)
            self._procedure = self.cycles(arm)
        except BaseException as error:
            self._end(error)
            raise

    @property
    def prepared(self) -> bool:
        """Whether :meth:`begin` has prepared it, so that it can be stepped."""
        return self._procedure is not None

    def step(self) -> None:
        """Advance to the next control cycle, or to the end; called before each cycle."""
        procedure = self._procedure
        if procedure is None or self.done:
            return
        self._stop_seen = self.claim.stopped
        try:
            if self._interruption is not None and not self.stopping:
                error, self._interruption = self._interruption, None
                self._cycle = procedure.throw(error)
            else:
                self._cycle = next(procedure)
        except StopIteration as stop:
            self._result = stop.value
            stopped = self.claim.stopped
            self._end(
                MotionCancelledError(f"{self.name} was stopped; nothing moves") if stopped else None
            )
        except BaseException as error:  # noqa: BLE001  raised by result()
            self._end(self._interruption or error)

    def observe(self, cycle: CycleReport) -> None:
        """Pass the record of the cycle that just ended to ``on_cycle``."""
        if self._on_cycle is None or self._cycle is None or self._recorder is None or self.done:
            return
        try:
            self._on_cycle(self._recorder.record(cycle, *self._cycle))
        except BaseException as error:  # noqa: BLE001  the arm is brought to rest first
            if self.stopping:
                self._on_cycle = None
            self.interrupt(error)

    def interrupt(self, error: BaseException) -> None:
        """Bring the devices to rest, and end with this error; also from another operation's stop.

        A request to end the program outranks other errors.
        """
        if self._interruption is None or not isinstance(error, Exception):
            self._interruption = error

    def abandon(self, error: BaseException) -> None:
        """End with this error, or with the one before it, although no cycle can run any more."""
        if self.done:
            return
        self._end(self._interruption or error)
        if self._procedure is not None:
            # It would come to rest in further cycles.
            with suppress(RuntimeError):
                self._procedure.close()

    @property
    def stop_unseen(self) -> bool:
        """Whether a stop was requested since the last step."""
        return self.claim.stopped and not self._stop_seen and not self.done

    @property
    def stopping(self) -> bool:
        """Whether the devices are coming to rest before the end."""
        return self._cycle is not None and self._cycle.phase is Phase.STOPPING

    @property
    def status(self) -> Status:
        """Stage of the operation."""
        if self.done:
            if self.error is None:
                return Status.SUCCEEDED
            cancelled = isinstance(self.error, MotionCancelledError | MotionTimeoutError)
            return Status.CANCELLED if cancelled else Status.FAILED
        if self.stopping or (self.claim.stopped and self._begun):
            return Status.STOPPING
        if self._paused:
            return Status.PAUSED
        return Status.WAITING if self._cycle is None else Status.RUNNING

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        return self.claim.ended

    @property
    def progress(self) -> float:
        """Share of it that is done, 0 to 1; NaN if that is unknown."""
        return 1.0 if self.done and self.error is None else math.nan

    @property
    def paused(self) -> bool:
        """Whether it was paused, and not resumed or ended since."""
        return self._paused and not self.done

    def pause(self) -> None:
        """Pause the motion on its path, as fast as a stop; from any thread.

        Does nothing if it is paused already.

        Raises:
            LifecycleError: It has ended.
            NotSupportedError: It cannot be paused.
        """
        self._require_pausable("pause()")
        self._paused = True

    def resume(self) -> None:
        """Continue a paused motion; does nothing if it is not paused.

        Raises:
            LifecycleError: It has ended.
            NotSupportedError: It cannot be paused.
        """
        self._require_pausable("resume()")
        self._paused = False

    def _require_pausable(self, what: str) -> None:
        if self.done:
            raise LifecycleError(f"{what}: {self.name} has ended ({self.status.value})")
        if not self.pausable:
            raise NotSupportedError(f"{self.name} cannot be paused; cancel() ends it")
        if self.claim.stopped:
            raise LifecycleError(f"{what}: {self.name} is being stopped; begin it again")

    pausable = False
    """Whether it can be paused."""

    def cancel(self) -> None:
        """Bring the devices to rest and end the operation, from any thread; returns at once.

        :meth:`result` then raises MotionCancelledError. Does nothing if it has ended.
        """
        self.claim.stopped = True
        self._paused = False

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the end, and return whether it has ended.

        Ctrl-C ends the wait and cancels the operation.

        Args:
            timeout: Longest time to wait [s]; None for no limit.

        Raises:
            BusyError: Called in a callback of a motion, which would wait for itself.
        """
        if self._arm is not None and not self.done:
            self._arm.require_outside(f"waiting for {self.name}")
        try:
            return self._finished.wait(timeout)
        except KeyboardInterrupt:
            self.cancel()
            raise

    def result(self, timeout: float | None = None) -> T:
        """Wait for the end and return the result.

        Args:
            timeout: Longest time to wait [s]; None for no limit. The operation goes on.

        Raises:
            MotionTimeoutError: It has not ended by then.
            BusyError: As :meth:`wait`.
            BioscaraError: The error that ended it.
        """
        if not self.wait(timeout):
            raise MotionTimeoutError(f"{self.name} has not ended within {timeout:g} s; it goes on")
        if self.error is not None:
            raise self.error
        return self._result  # type: ignore[return-value]  # set by a procedure that returned

    def when_done(self, callback: Callable[[], object]) -> None:
        """Call a function at the end, in the thread that steps the arm; at once if it has ended."""
        self._callbacks.append(callback)
        if self.done:
            self._call_back()

    def __await__(self) -> Generator[Any, None, T]:
        return self._awaited().__await__()

    async def _awaited(self) -> T:
        """Return the result; cancelling the awaiting task stops the operation."""
        loop, ended = asyncio.get_running_loop(), asyncio.Event()

        def wake() -> None:
            # The loop may have been closed since.
            with suppress(RuntimeError):
                loop.call_soon_threadsafe(ended.set)

        self.when_done(wake)
        try:
            await ended.wait()
        except asyncio.CancelledError:
            self.cancel()
            # The caller continues once the arm is at rest, even if it is cancelled again.
            while not self.done:
                with suppress(asyncio.CancelledError):
                    await asyncio.sleep(0.01)
            raise
        return self.result()

    def forget(self) -> None:
        """Drop the result and the tracebacks of an ended operation, for an owner of many of these.

        The frames of a traceback hold samples and trajectories, some hundred kilobytes.
        """
        self._result = self._recorder = self._procedure = None
        error = self.error
        while error is not None:
            error.__traceback__ = None
            error = error.__cause__ or error.__context__

    def _end(self, error: BaseException | None) -> None:
        self.error = error
        self.claim.ended = True
        self.claim.released.set()
        self._finished.set()
        self._call_back()

    def _call_back(self) -> None:
        # Two threads may get here at once.
        with suppress(IndexError):
            while True:
                self._callbacks.pop()()

    def __repr__(self) -> str:
        progress = "" if math.isnan(self.progress) else f", {self.progress:.0%}"
        reason = f": {self.error}" if self.error is not None else ""
        return f"<{self.name} {self.status.value}{progress}{reason}>"
