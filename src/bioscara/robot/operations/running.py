"""The handle of something that an arm does, in this process or that of an owner."""

from __future__ import annotations

import asyncio
import math
import threading
from abc import abstractmethod
from collections.abc import Callable, Coroutine, Generator
from contextlib import suppress
from enum import StrEnum
from typing import Any, Generic, TypeVar

from bioscara.errors import MotionCancelledError, MotionTimeoutError
from bioscara.planning.motions.jog_limitation import JogLimitation

T = TypeVar("T")

_POLL = 0.01
"""Period in which a cancelled task of asyncio looks whether the devices are at rest [s]."""


class Status(StrEnum):
    """Stage of an operation."""

    WAITING = "waiting"
    """Not begun, or not stepped yet."""
    RUNNING = "running"
    PAUSED = "paused"
    STOPPING = "stopping"
    SUCCEEDED = "succeeded"
    CANCELLED = "cancelled"
    FAILED = "failed"


class Running(Coroutine[Any, Any, T], Generic[T]):
    """Something that an arm does: the handle of a motion that was begun without waiting.

    ``await`` returns its result; ``asyncio.create_task()`` and a ``TaskGroup`` take it as they take
    a coroutine, and cancelling such a task cancels it.

    Args:
        name: Name for messages, such as ``"home()"``.

    Attributes:
        name: As given.
        error: Why it ended early; None otherwise.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.error: BaseException | None = None
        self._finished = threading.Event()
        self._callbacks: list[Callable[[], object]] = []
        self._coroutine: Coroutine[Any, Any, T] | None = None

    @property
    @abstractmethod
    def done(self) -> bool:
        """Whether it has ended."""

    @property
    @abstractmethod
    def begun(self) -> bool:
        """Whether it was accepted; a refused one has moved nothing."""

    @property
    @abstractmethod
    def progress(self) -> float:
        """Share of it that is done, 0 to 1; NaN if that is unknown."""

    @property
    @abstractmethod
    def paused(self) -> bool:
        """Whether it was paused, and not resumed or ended since."""

    @property
    @abstractmethod
    def limitation(self) -> JogLimitation | None:
        """Why a jog does not fully follow its velocity.

        Its joints, its surroundings, the speed limit or the end of its reach; None if it does, at
        rest and for other operations. After the end, as it was when the velocities ended.
        """

    @property
    def notes(self) -> tuple[str, ...]:
        """How the plan of a motion differs from the request, as :class:`Plan` has it.

        Such as that it takes longer to keep the tool at 250 mm/s; none for other operations.
        """
        return ()

    @property
    def status(self) -> Status:
        """Stage of the operation."""
        if not self.done:
            return self._stage()
        if self.error is None:
            return Status.SUCCEEDED
        cancelled = isinstance(self.error, MotionCancelledError | MotionTimeoutError)
        return Status.CANCELLED if cancelled else Status.FAILED

    @abstractmethod
    def _stage(self) -> Status:
        """Return the stage of an operation that has not ended."""

    @abstractmethod
    def pause(self) -> None:
        """Pause the motion on its path, as fast as a stop; from any thread.

        Does nothing if it is paused already.

        Raises:
            LifecycleError: It has ended.
            NotSupportedError: It cannot be paused.
        """

    @abstractmethod
    def resume(self) -> None:
        """Continue a paused motion; does nothing if it is not paused.

        Raises:
            LifecycleError: It has ended.
            NotSupportedError: It cannot be paused.
        """

    @abstractmethod
    def cancel(self) -> None:
        """Bring the devices to rest and end the operation, from any thread.

        :meth:`result` then raises MotionCancelledError. Does nothing if it has ended.
        """

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the end, and return whether it has ended.

        Ctrl-C ends the wait and cancels the operation.

        Args:
            timeout: Longest time to wait [s]; None for no limit.

        Raises:
            BusyError: Called in a callback of a motion, which would wait for itself.
            NotInitializedError: It belongs to a parent process.
        """
        self._require_waitable()
        try:
            return self._finished.wait(timeout)
        except KeyboardInterrupt:
            self.cancel()
            raise

    @abstractmethod
    def _require_waitable(self) -> None:
        """Raise if this thread may not wait for the end."""

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
        return self._outcome()

    @abstractmethod
    def _outcome(self) -> T:
        """Return the result of an operation that succeeded."""

    def when_done(self, callback: Callable[[], object]) -> None:
        """Call a function at the end, in a thread of the robot; at once if it has ended."""
        self._callbacks.append(callback)
        if self.done:
            self._call_back()

    def _finish(self) -> None:
        """Wake those that wait for the end, and call those that asked for it."""
        self._finished.set()
        self._call_back()

    def _call_back(self) -> None:
        # Two threads may get here at once.
        with suppress(IndexError):
            while True:
                self._callbacks.pop()()

    def __await__(self) -> Generator[Any, None, T]:
        return self._awaited().__await__()

    async def _awaited(self) -> T:
        loop, ended = asyncio.get_running_loop(), asyncio.Event()

        def wake() -> None:
            # The loop may have been closed since.
            with suppress(RuntimeError):
                loop.call_soon_threadsafe(ended.set)

        self.when_done(wake)
        try:
            await ended.wait()
        except asyncio.CancelledError:
            # In a thread, as an owner may answer late.
            loop.run_in_executor(None, self.cancel)
            # The caller continues once the arm is at rest, even if it is cancelled again.
            while not self.done:
                with suppress(asyncio.CancelledError):
                    await asyncio.sleep(_POLL)
            raise
        return self.result()

    def send(self, value: Any) -> Any:
        """Advance the task of asyncio that waits for the end; asyncio calls it."""
        if self._coroutine is None:
            self._coroutine = self._awaited()
        return self._coroutine.send(value)

    def throw(self, *error: Any) -> Any:
        """Raise an error, as a cancellation, in the task that waits for the end; likewise."""
        if self._coroutine is None:
            self._coroutine = self._awaited()
        return self._coroutine.throw(*error)

    def close(self) -> None:
        """End the task that waits for the end; the operation goes on. asyncio calls it."""
        if self._coroutine is not None:
            self._coroutine.close()

    def __repr__(self) -> str:
        progress = self.progress
        share = "" if math.isnan(progress) else f", {progress:.0%}"
        reason = f": {self.error}" if self.error is not None else ""
        return f"<{self.name} {self.status.value}{share}{reason}>"
