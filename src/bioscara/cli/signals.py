"""Ctrl-C and the signals that end a process, while a command drives an arm or writes a board."""

from __future__ import annotations

import _thread
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from bioscara.robot.arm_methods import ArmMethods

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StopRequest:
    """While entered, Ctrl-C, SIGTERM and SIGHUP only set a flag, and stop the arm.

    A motion is never interrupted midway: the arm comes to rest, and must end up disabled. Main
    thread only.

    Attributes:
        requested: True once a signal arrived.
    """

    def __init__(self) -> None:
        self.requested = False
        self._stop: Callable[[], object] | None = None

    def __call__(self) -> bool:
        """Return whether to stop."""
        return self.requested

    def __enter__(self) -> Self:
        self._previous = [(number, signal.signal(number, self._mark)) for number in _SIGNALS]
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._previous:
            signal.signal(number, handler)

    @contextmanager
    def ending_calls_of(self, robot: ArmMethods) -> Iterator[None]:
        """Let a signal end the calls of a robot within a block of code, also one from before."""
        # Imported here: commands without an arm have signals, too.
        from bioscara.errors import BioscaraError  # noqa: PLC0415

        def stop() -> None:
            # Of an owner that is lost the motions have ended.
            with suppress(BioscaraError):
                robot.cancel()

        with robot.one_call():
            self._stop = stop
            try:
                if self.requested:
                    stop()
                yield
            finally:
                self._stop = None

    def _mark(self, number: int, frame: FrameType | None) -> None:  # noqa: ARG002 (signal's form)
        # A plain attribute: an Event's lock could be held by the thread interrupted here.
        self.requested = True
        if self._stop is not None:
            # In a thread of its own, as it takes locks, too.
            _thread.start_new_thread(self._stop, ())


@contextmanager
def raising_keyboard_interrupt() -> Iterator[None]:
    """Handle SIGTERM and a closed terminal as Ctrl-C, as a KeyboardInterrupt."""
    numbers = (signal.SIGTERM, signal.SIGHUP)
    before = [(number, signal.signal(number, signal.default_int_handler)) for number in numbers]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)
