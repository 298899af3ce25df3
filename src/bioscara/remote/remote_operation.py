"""The handle of a motion that an owner carries out."""

from __future__ import annotations

import math
import queue
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from bioscara.api import messages as m
from bioscara.api.failures import error_of
from bioscara.api.values import gripper_of
from bioscara.errors import BioscaraError, LeaseError, OwnerLostError
from bioscara.planning.motions.jog_limitation import JogLimitation
from bioscara.remote.lease_keeper import LeaseKeeper
from bioscara.remote.link import OwnerLink
from bioscara.report import CycleRecord, Phase
from bioscara.robot.operations.operation import OnCycle
from bioscara.robot.operations.running import Running, Status

T = TypeVar("T")

_POLL = 0.1
"""Period in which a wait looks for Ctrl-C [s]."""


class RemoteOperation(Running[T]):
    """A goal of an owner.

    Args:
        link: The connection.
        lease: The lease.
        value: The goal as it began.
        on_cycle: Receives the record of each cycle; None for no records.
        observed: Whether a thread calls :meth:`observe`, whose end is that of the operation.

    Attributes:
        goal: Its number at the owner.
    """

    def __init__(
        self,
        link: OwnerLink,
        lease: LeaseKeeper,
        value: m.GoalValue,
        on_cycle: OnCycle | None,
        *,
        observed: bool,
    ) -> None:
        super().__init__(value.name)
        self.goal = value.goal
        self._link, self._lease, self._value = link, lease, value
        self._on_cycle, self._observed = on_cycle, observed
        self._records: queue.SimpleQueue[CycleRecord | None] = queue.SimpleQueue()
        self._over = threading.Event()
        self._raised: BaseException | None = None

    def take(self, value: m.GoalValue) -> None:
        """Take the goal as it ended."""
        if self._over.is_set():
            return
        self._value = value
        self._end(None if value.failure is None else error_of(value.failure))

    def lose(self, error: OwnerLostError) -> None:
        """End, as the owner was lost."""
        if not self._over.is_set():
            self._end(OwnerLostError(str(error)))

    def record(self, record: CycleRecord) -> None:
        """Take the record of a cycle."""
        self._records.put(record)

    def interrupt(self, error: BaseException) -> None:
        """Cancel the goal, as a callback of it has raised; it then ends with this error."""
        if self._raised is None or not isinstance(error, Exception):
            self._raised = error
        self.cancel()

    def _end(self, error: BaseException | None) -> None:
        self.error = error
        self._over.set()
        if self._observed:
            # The last records come first.
            self._records.put(None)
        else:
            self._report()

    def _report(self) -> None:
        if self._raised is not None:
            self.error = self._raised
        self._finish()

    def observe(self) -> None:
        """Pass the records to ``on_cycle`` until the end, in this thread.

        If it raises, the goal is cancelled and ends with that.
        """
        on_cycle, record = self._on_cycle, None
        while on_cycle is not None:
            try:
                record = self._records.get(timeout=_POLL)
                if record is None:
                    break
                on_cycle(record)
            except queue.Empty:
                # The end may have come, with records before it, since the wait timed out.
                if self._over.is_set() and self._records.empty():
                    break
            except BaseException as error:  # noqa: BLE001  the arm is brought to rest first
                self.interrupt(error)
                if record is not None and record.phase is Phase.STOPPING:
                    on_cycle = None
        while not self._over.wait(_POLL):
            self._require_heard()
        self._report()

    def _require_heard(self) -> None:
        """End if the owner is silent for too long."""
        try:
            self._link.require_heard()
        except OwnerLostError as error:
            self.lose(error)

    def run(self) -> T:
        """Wait for the end in the thread that began it, and return the result.

        An exception that interrupts this, such as KeyboardInterrupt, cancels the goal and is raised
        once the devices are at rest.
        """
        while not self.done:
            try:
                self.observe()
            except BaseException as error:  # noqa: BLE001  raised by result()
                self.interrupt(error)
        return self.result()

    def wait(self, timeout: float | None = None) -> bool:
        end = math.inf if timeout is None else time.monotonic() + timeout
        while not (done := super().wait(min(max(end - time.monotonic(), 0.0), _POLL))):
            if time.monotonic() >= end:
                break
            self._require_heard()
        return done

    @property
    def begun(self) -> bool:
        return True

    @property
    def done(self) -> bool:
        return self._finished.is_set()

    def _stage(self) -> Status:
        return self._now().status

    @property
    def progress(self) -> float:
        return self._now().progress

    @property
    def limitation(self) -> JogLimitation | None:
        return self._now().limitation

    @property
    def notes(self) -> tuple[str, ...]:
        return self._value.notes

    @property
    def paused(self) -> bool:
        return self.status is Status.PAUSED

    def _now(self) -> m.GoalValue:
        if self._over.is_set():
            return self._value
        result = self._link.request(m.GetGoal(self.goal))
        return result.goal if isinstance(result, m.GoalState) else self._value

    def pause(self) -> None:
        self._link.request(m.PauseGoal(self.goal), self._lease.epoch())

    def resume(self) -> None:
        self._link.request(m.ResumeGoal(self.goal), self._lease.epoch())

    def cancel(self) -> None:
        # Without the lease it is being stopped already.
        if not self._over.is_set() and (epoch := self._lease.held) is not None:
            with suppress(LeaseError, OwnerLostError):
                self._link.request(m.Cancel(self.goal), epoch)

    def _require_waitable(self) -> None:
        self._link.maker.require()

    def _outcome(self) -> T:
        gripper = self._value.gripper
        result: Any = None if gripper is None else gripper_of(gripper)
        return result  # type: ignore[no-any-return]  # a motion of the jaws has one, others none

    def __repr__(self) -> str:
        try:
            return super().__repr__()
        except BioscaraError:
            return f"<{self.name} {self._value.status}>"


class Beginning:
    """The begin of a goal in a call that Ctrl-C may interrupt at any point.

    Args:
        make: Returns the operation for the answer of the owner.
    """

    def __init__(self, make: Callable[[m.AnyResult], RemoteOperation[Any]]) -> None:
        self._make = make
        self._begun: RemoteOperation[Any] | None = None
        self._error: BaseException | None = None

    @property
    def operation(self) -> RemoteOperation[Any]:
        """The operation; the answer has been taken."""
        assert self._begun is not None  # noqa: S101  a request ends with its answer or raises
        return self._begun

    def take(self, answer: m.AnyResult) -> None:
        """Take the answer, in the thread of the connection."""
        self._begun = self._make(answer)
        if self._error is not None:
            # In a thread of its own, as it makes requests.
            threading.Thread(target=self.interrupt, args=(self._error,), daemon=True).start()

    def interrupt(self, error: BaseException) -> None:
        """Bring the devices to rest if the goal has begun, and if it begins later."""
        self._error = error
        operation = self._begun
        if operation is None or operation.done:
            return
        try:
            operation.interrupt(error)
            operation.run()
        except BaseException:  # noqa: BLE001, S110  the caller raises the first error
            pass
