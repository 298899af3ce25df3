"""Mutual exclusion of the calls that use the arm, across all threads."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import wraps
from typing import Concatenate, ParamSpec, Protocol, TypeVar

from bioscara.errors import BusyError, MotionCancelledError

_POLL = 0.1
"""Polling period of a shutdown that waits for a call's end, in case no event is set [s]."""


@dataclass(eq=False, slots=True)
class Call:
    """A call that uses the arm, from its start to its end.

    Attributes:
        name: Name of the called method, for messages.
        thread: The calling thread.
        begin: Time of the call [s], on the machine's monotonic clock, not the arm's clock.
        ended: Set at its end.
        stopped: Whether a stop was requested.
        cycling: Whether it has started to run the control loop.
    """

    name: str
    thread: threading.Thread = field(default_factory=threading.current_thread)
    begin: float = field(default_factory=time.monotonic)
    ended: threading.Event = field(default_factory=threading.Event)
    stopped: bool = False
    cycling: bool = False

    def refuse(self, name: str) -> BusyError:
        """Return the error for another call that is refused while this call runs."""
        inside = self.thread is threading.current_thread()
        return BusyError(name, self.name, time.monotonic() - self.begin, self.thread.name, inside)


class CallArbiter:
    """Admits one call at a time to the arm; other calls may read its state.

    There is no queue: a queued call could begin to move after a stop.

    Attributes:
        running: The call that uses the arm; None if there is none.
    """

    def __init__(self) -> None:
        self.running: Call | None = None
        self._closing: list[Call] = []
        self._admission, self._reading = threading.Lock(), threading.Lock()

    def take(self, call: Call) -> None:
        """Let a call use the arm.

        Raises:
            BusyError: Another call uses the arm, of any thread.
        """
        with self._admission:
            for other in (self.running, *self._closing):
                if other is not None:
                    raise other.refuse(call.name)
            self.running = call
        self._wait_for_readers()

    def seize(self, call: Call) -> None:
        """Stop the call that uses the arm, wait for its end, and let this call use the arm next.

        Raises:
            BusyError: The call would wait for its own thread.
        """
        try:
            with self._admission:
                if self.running is not None and self.running.thread is call.thread:
                    raise self.running.refuse(call.name)
                self._closing.append(call)
            while True:
                with self._admission:
                    running = self.running
                    if running is None:
                        self.running = call
                        break
                running.stopped = True
                running.ended.wait(_POLL)
        finally:
            if call in self._closing:
                self._closing.remove(call)
        self._wait_for_readers()

    def stop(self) -> None:
        """Request the end of the running call, from any thread or signal handler; never blocks."""
        stopped = None
        # Repeated: the stop also applies to a call that began while another one ended.
        while (running := self.running) is not stopped:
            if running is not None:
                running.stopped = True
            stopped = running

    @property
    def stopped(self) -> bool:
        """Whether a stop of the call that uses the arm was requested."""
        running = self.running
        return running is not None and running.stopped

    def require_not_stopped(self) -> None:
        """Raise if a stop of the call that uses the arm was requested.

        Raises:
            MotionCancelledError: A stop was requested.
        """
        running = self.running
        if running is not None and running.stopped:
            raise MotionCancelledError(f"{running.name} was stopped before anything moved")

    def mark_cycling(self) -> None:
        """Mark the call that uses the arm as running the control loop from now on."""
        if self.running is not None:
            self.running.cycling = True

    def read_unless_busy(self, read: Callable[[], None]) -> Call | None:
        """Read the joints, unless another call runs; its control loop then reads them.

        Args:
            read: Reads the joints; runs while no other call uses the arm or reads its state.

        Returns:
            The running call because of which the joints were not read; None if they were read.
        """
        running = self.running
        if running is not None and running.thread is threading.current_thread():
            if running.cycling:
                return running
            read()
            return None
        with self._reading:
            running = self.running
            if running is None:
                read()
        return running

    def _wait_for_readers(self) -> None:
        """Wait for a thread that is reading the joints; later ones see the running call."""
        with self._reading:
            pass


class _HasArbiter(Protocol):
    _arbiter: CallArbiter


T = TypeVar("T", bound=_HasArbiter)
P = ParamSpec("P")
R = TypeVar("R")


def exclusive(
    name: str, *, last: bool = False
) -> Callable[[Callable[Concatenate[T, P], R]], Callable[Concatenate[T, P], R]]:
    """Give a method exclusive use of the arm; it raises MotionCancelledError if it was stopped.

    Such a method is refused inside another one, so that a callback cannot start a motion within a
    motion.

    Args:
        name: Name of the method in messages.
        last: Whether it stops the call that uses the arm and waits for its end, instead of being
            refused.
    """

    def decorate(method: Callable[Concatenate[T, P], R]) -> Callable[Concatenate[T, P], R]:
        @wraps(method)
        def alone(self: T, /, *args: P.args, **kwargs: P.kwargs) -> R:
            arbiter, call = self._arbiter, Call(name)
            try:
                if last:
                    arbiter.seize(call)
                else:
                    arbiter.take(call)
                result = method(self, *args, **kwargs)
            finally:
                # Before any function call: a KeyboardInterrupt can be raised at a function call,
                # and the arm would never be released.
                if arbiter.running is call:
                    arbiter.running = None
                call.ended.set()
            if call.stopped and not last:
                # Also if the method had already finished: its caller must not continue.
                raise MotionCancelledError(f"{name} was stopped; nothing moves")
            return result

        return alone

    return decorate
