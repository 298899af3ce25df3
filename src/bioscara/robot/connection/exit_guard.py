"""Release of the joints when a program ends without closing its robot, or by a signal."""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, Protocol

_SIGNALS = (signal.SIGTERM, signal.SIGHUP)
_PATIENCE = 15.0
"""Time after which a signal interrupts the closing of a robot, whose callback may hang [s]."""


class Closeable(Protocol):
    """A robot that a program has opened."""

    def close(self) -> None:
        """End the motions of this program, and release what it has of the arm."""


# Not weak: a program may keep no reference to its robot, only to a motion or to nothing.
_guarded: dict[Closeable, Callable[[], object]] = {}
_replaced: dict[int, Any] = {}
_closing: list[float] = []
"""Times at which the main thread began to close a robot, while it does [s]."""
_postponed: list[int] = []
"""Signals that arrived during the closing."""


def guard(robot: Closeable, stop: Callable[[], object]) -> None:
    """Close a robot when the program ends.

    SIGTERM and SIGHUP raise SystemExit in the main thread from now on, as Ctrl-C raises
    KeyboardInterrupt, unless the program handles them itself. A robot that is still open when the
    interpreter ends is closed then. A forked child, to which the robot does not belong, forgets it.

    Args:
        robot: A robot that was just opened.
        stop: Requests the end of the motions of this program; must not block.
    """
    if not _guarded:
        atexit.register(_close_all)
    _guarded[robot] = stop
    if threading.current_thread() is not threading.main_thread():
        return  # Only the main thread may handle signals.
    for number in _SIGNALS:
        if number not in _replaced and signal.getsignal(number) is signal.SIG_DFL:
            _replaced[number] = signal.signal(number, _exit)


def forget(robot: Closeable) -> None:
    """End the guard of a robot that is closed."""
    _guarded.pop(robot, None)
    if _guarded:
        return
    atexit.unregister(_close_all)
    if threading.current_thread() is threading.main_thread():
        _restore_handlers()


def _restore_handlers() -> None:
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
    for stop in [*_guarded.values()]:
        stop()
    raise _ending(number)


def _ending(number: int) -> BaseException:
    """Return what ends a program by a signal."""
    if number == signal.SIGINT:
        return KeyboardInterrupt()
    # The status of a process that such a signal ended, for shells and supervisors.
    return SystemExit(128 + number)


def _close_all() -> None:
    # The program is ending already.
    with suppress(SystemExit, KeyboardInterrupt), postponed():
        for robot in [*_guarded]:
            try:
                robot.close()
            except (SystemExit, KeyboardInterrupt):
                pass  # This one's closing took too long; the others are closed nevertheless.
            except Exception as error:  # noqa: BLE001  likewise
                sys.stderr.write(f"bioscara: at exit: {error}\n")


def _forget_all() -> None:
    """Forget the robots of the parent in a forked child, whose main thread is the present one."""
    _guarded.clear()
    _closing.clear()
    _postponed.clear()
    atexit.unregister(_close_all)
    _restore_handlers()


os.register_at_fork(after_in_child=_forget_all)
