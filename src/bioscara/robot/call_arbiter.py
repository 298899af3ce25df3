"""Whose turn it is: of the calls that use the arm one runs at a time, from whatever thread."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import wraps
from typing import Concatenate, ParamSpec, Protocol, TypeVar

from bioscara.errors import BusyError, MotionCancelledError

_LOOK = 0.1
"""How often a shutdown looks whether what it waits for has ended, should nobody tell it [s]."""


@dataclass(eq=False, slots=True)
class Call:
    """One call that uses the arm, from its begin to its end.

    Attributes:
        name: What was called, for people.
        thread: Who called it.
        begin: When [s], on the machine's clock whatever the arm's is.
        ended: Set when it is over.
        stopped: Whether it was asked to end.
        cycling: Whether it runs the control loop from now on.
    """

    name: str
    thread: threading.Thread = field(default_factory=threading.current_thread)
    begin: float = field(default_factory=time.monotonic)
    ended: threading.Event = field(default_factory=threading.Event)
    stopped: bool = False
    cycling: bool = False

    def refuse(self, name: str) -> BusyError:
        """Return why something else cannot be done while this call runs."""
        inside = self.thread is threading.current_thread()
        return BusyError(name, self.name, time.monotonic() - self.begin, self.thread.name, inside)


class CallArbiter:
    """Lets one call at a time use the arm, and others look at it.

    Nothing waits for its turn: what had waited could begin to move after a stop.

    Attributes:
        running: The call that uses the arm; None where nothing does.
    """

    def __init__(self) -> None:
        self.running: Call | None = None
        self._closing: list[Call] = []
        self._taking, self._looking = threading.Lock(), threading.Lock()

    def take(self, call: Call) -> None:
        """Let a call use the arm.

        Raises:
            BusyError: Another one does, of whatever thread.
        """
        with self._taking:
            for other in (self.running, *self._closing):
                if other is not None:
                    raise other.refuse(call.name)
            self.running = call
        self._wait_for_lookers()

    def seize(self, call: Call) -> None:
        """Stop what uses the arm, wait for its end, and let this call use the arm next.

        Raises:
            BusyError: It would wait for its own thread.
        """
        try:
            with self._taking:
                if self.running is not None and self.running.thread is call.thread:
                    raise self.running.refuse(call.name)
                self._closing.append(call)
            while True:
                with self._taking:
                    running = self.running
                    if running is None:
                        self.running = call
                        break
                running.stopped = True
                running.ended.wait(_LOOK)
        finally:
            if call in self._closing:
                self._closing.remove(call)
        self._wait_for_lookers()

    def stop(self) -> None:
        """Ask what uses the arm to end; from any thread or signal handler, and never waits."""
        stopped = None
        # Looked at again: a call that began while another one ended is meant as well.
        while (running := self.running) is not stopped:
            if running is not None:
                running.stopped = True
            stopped = running

    @property
    def stopped(self) -> bool:
        """Whether the call that uses the arm was asked to end."""
        running = self.running
        return running is not None and running.stopped

    def require_wanted(self) -> None:
        """Raise if the call that uses the arm was asked to end.

        Raises:
            MotionCancelledError: It was.
        """
        running = self.running
        if running is not None and running.stopped:
            raise MotionCancelledError(f"{running.name} was stopped before anything moved")

    def cycle(self) -> None:
        """Take note that the call that uses the arm runs the control loop from now on."""
        if self.running is not None:
            self.running.cycling = True

    def look(self, ask: Callable[[], None]) -> Call | None:
        """Let somebody look at the arm: ask the joints, or leave that to the call that runs.

        Args:
            ask: Asks the joints; runs while nobody else uses the arm or looks at it.

        Returns:
            The call because of which nobody was asked.
        """
        running = self.running
        if running is not None and running.thread is threading.current_thread():
            if running.cycling:
                return running
            ask()
            return None
        with self._looking:
            running = self.running
            if running is None:
                ask()
        return running

    def _wait_for_lookers(self) -> None:
        """Wait for who is asking the joints; who comes later sees that a call runs."""
        with self._looking:
            pass


class _Taker(Protocol):
    _turn: CallArbiter


T = TypeVar("T", bound=_Taker)
P = ParamSpec("P")
R = TypeVar("R")


def exclusive(
    name: str, *, last: bool = False
) -> Callable[[Callable[Concatenate[T, P], R]], Callable[Concatenate[T, P], R]]:
    """Let a method use the arm alone, and end with MotionCancelledError if it was stopped.

    Such a method is refused inside another one, so that a callback cannot move within a motion.

    Args:
        name: What people call it.
        last: Whether it stops and waits for what uses the arm, instead of being refused.
    """

    def decorate(method: Callable[Concatenate[T, P], R]) -> Callable[Concatenate[T, P], R]:
        @wraps(method)
        def alone(self: T, /, *args: P.args, **kwargs: P.kwargs) -> R:
            turn, call = self._turn, Call(name)
            try:
                if last:
                    turn.seize(call)
                else:
                    turn.take(call)
                result = method(self, *args, **kwargs)
            finally:
                # Before anything is called: at a call a KeyboardInterrupt can come in, and the
                # turn would never be given back.
                if turn.running is call:
                    turn.running = None
                call.ended.set()
            if call.stopped and not last:
                # Also where it had nothing left to end: who called it shall not go on.
                raise MotionCancelledError(f"{name} was stopped; nothing moves")
            return result

        return alone

    return decorate
