"""Operations of an arm: begun on request, then stepped once a control cycle until they end."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Generator
from contextlib import suppress
from typing import NamedTuple, TypeVar

from bioscara.arguments import function, number
from bioscara.control.loop.loop import CycleReport
from bioscara.errors import (
    InvalidArgumentError,
    LifecycleError,
    MotionCancelledError,
    NotSupportedError,
)
from bioscara.planning.motions.jog_limitation import JogLimitation
from bioscara.report import CycleRecord, Phase
from bioscara.robot.arm import Arm
from bioscara.robot.operations.arbiter import ARM, Claim, Device
from bioscara.robot.operations.cycle_recorder import CycleRecorder
from bioscara.robot.operations.running import Running, Status

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


class Operation(Running[T]):
    """Something that an arm does, stepped in this process.

    :meth:`begin` claims its devices and prepares it in the calling thread, as planning may take
    longer than a cycle; :meth:`step` is called by the control loop before each cycle. However it
    ends, the devices are at rest before the end is reported. An operation is used once.

    Args:
        name: Name for messages, such as ``"home()"``.
        timeout: Longest duration from its first cycle [s]; None for no limit.
        on_cycle: Receives the record of each cycle; None for no records.

    Attributes:
        claim: Its claim to the devices.

    Raises:
        InvalidArgumentError: The timeout is not above zero, or ``on_cycle`` cannot be called.
    """

    devices: frozenset[Device] = ARM
    _needs_confirmed_scene = False
    """Whether it moves something autonomously, and not by a person's hand as a jog."""

    def __init__(
        self, name: str, *, timeout: float | None = None, on_cycle: OnCycle | None = None
    ) -> None:
        super().__init__(name)
        self.claim = Claim(name, self.devices)
        self.timeout = math.inf if timeout is None else number("timeout", timeout, infinite=True)
        if not self.timeout > 0.0:
            raise InvalidArgumentError(f"timeout {self.timeout:g} s must be above zero")
        if on_cycle is not None:
            function("on_cycle", on_cycle)
        self._limitation: JogLimitation | None = None
        self._on_cycle = on_cycle
        self._recorder: CycleRecorder | None = None
        self._interruption: BaseException | None = None
        self._procedure: Cycles[T] | None = None
        self._cycle: Cycle | None = None
        self._result: T | None = None
        self._begun = self._paused = self._stop_seen = False
        self._arm: Arm | None = None

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
    def begun(self) -> bool:
        return self.prepared

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
            record = self._recorder.record(cycle, *self._cycle)
            self._on_cycle(record._replace(progress=self.progress))
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

    def _stage(self) -> Status:
        if self.stopping or (self.claim.stopped and self._begun):
            return Status.STOPPING
        if self._paused:
            return Status.PAUSED
        return Status.WAITING if self._cycle is None else Status.RUNNING

    @property
    def done(self) -> bool:
        return self.claim.ended

    @property
    def limitation(self) -> JogLimitation | None:
        return self._limitation

    @property
    def progress(self) -> float:
        return 1.0 if self.done and self.error is None else math.nan

    @property
    def paused(self) -> bool:
        return self._paused and not self.done

    def pause(self) -> None:
        self._require_pausable("pause()")
        self._paused = True

    def resume(self) -> None:
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
    author = ""
    """Key of the client that begins it; empty for the program that has the arm."""

    @property
    def caller(self) -> tuple[str, str]:
        """Its name and its author, for warnings that concern its caller alone."""
        return self.name, self.author

    def cancel(self) -> None:
        self.claim.stopped = True
        self._paused = False

    def _require_waitable(self) -> None:
        if self._arm is not None and not self.done:
            self._arm.require_outside(f"waiting for {self.name}")

    def _outcome(self) -> T:
        return self._result  # type: ignore[return-value]  # set by a procedure that returned

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
        self._finish()
