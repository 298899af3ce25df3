"""Release of the joints when a program ends without closing its robot, or by a signal."""

from __future__ import annotations

import atexit
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, Protocol

_SIGNALS = (signal.SIGTERM, signal.SIGHUP)
_PATIENCE = 15.0
"""Time after which a signal interrupts the closing of a robot, whose callback may hang [s]."""


class Closeable(Protocol):
    """Something that releases the joints."""

    def stop(self) -> None:
        """Request the end of all motion; must not block."""

    def close(self) -> None:
        """Stop all motion and disable all joints."""


# Not weak: a program may keep no reference to its robot, only to a motion or to nothing.
_guarded: set[Closeable] = set()
_replaced: dict[int, Any] = {}
_closing: list[float] = []
"""Times at which the main thread began to close a robot, while it does [s]."""
_postponed: list[int] = []
"""Signals that arrived during the closing."""


def guard(robot: Closeable) -> None:
    """Close a robot when the program ends.

    SIGTERM and SIGHUP raise SystemExit in the main thread from now on, as Ctrl-C raises
    KeyboardInterrupt, unless the program handles them itself. A robot that is still open when the
    interpreter ends is closed then.

    Args:
        robot: A robot that was just opened.
    """
    if not _guarded:
        atexit.register(_close_all)
    _guarded.add(robot)
    if threading.current_thread() is not threading.main_thread():
        return  # Only the main thread may handle signals.
    for number in _SIGNALS:
        if number not in _replaced and signal.getsignal(number) is signal.SIG_DFL:
            _replaced[number] = signal.signal(number, _exit)


def forget(robot: Closeable) -> None:
    """End the guard of a robot that is closed."""
    _guarded.discard(robot)
    if _guarded:
        return
    atexit.unregister(_close_all)
    if threading.current_thread() is not threading.main_thread():
        return
    for number in [*_replaced]:
        if signal.getsignal(number) is _exit:
            signal.signal(number, _replaced[number])
        del _replaced[number]


@contextmanager
def postponed() -> Iterator[None]:
    """Postpone signals, and Ctrl-C, to the end of the block, which closes a robot.

    Each one would interrupt the closing, which then begins anew: signals that repeat faster than
    the joints can be released would keep them energised. Ctrl-C of a program that handles SIGINT
    itself is not postponed.

    Raises:
        SystemExit: A signal arrived in the block.
        KeyboardInterrupt: Ctrl-C did.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # Only the main thread is interrupted by signals.
        return
    outer = len(_closing)
    try:
        _closing.append(time.monotonic())
        # Not before: asyncio and notebooks look for Python's own handler.
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, _exit)
        yield
    finally:
        del _closing[outer:]
        if not _closing:
            number = _postponed[0] if _postponed else None
            _postponed.clear()
            if signal.getsignal(signal.SIGINT) is _exit:
                signal.signal(signal.SIGINT, signal.default_int_handler)
            if number is not None:
                raise _ending(number)


def _exit(number: int, frame: FrameType | None) -> None:  # noqa: ARG001  the form of a handler
    if _closing and time.monotonic() - _closing[0] < _PATIENCE:
        _postponed.append(number)
        return
    # Python drops an exception that is raised within a finalizer: the motion ends nevertheless.
    for robot in [*_guarded]:
        robot.stop()
    raise _ending(number)


def _ending(number: int) -> BaseException:
    """Return what ends a program by a signal."""
    if number == signal.SIGINT:
        return KeyboardInterrupt()
    # The status of a process that such a signal ended, for shells and supervisors.
    return SystemExit(128 + number)


def _close_all() -> None:
    # The program is ending by itself.
    with suppress(SystemExit, KeyboardInterrupt), postponed():
        for robot in [*_guarded]:
            try:
                robot.close()
            except (SystemExit, KeyboardInterrupt):
                pass  # This one's closing took too long; the others are closed nevertheless.
            except Exception as error:  # noqa: BLE001  likewise
                sys.stderr.write(f"bioscara: at exit: {error}\n")
