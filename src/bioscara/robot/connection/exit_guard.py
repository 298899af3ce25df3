"""Release of the joints when a program ends without closing its robot, or by a signal."""

from __future__ import annotations

import atexit
import signal
import sys
import threading
from types import FrameType
from typing import Any, Protocol
from weakref import WeakSet

_SIGNALS = (signal.SIGTERM, signal.SIGHUP)


class Closeable(Protocol):
    """Something that releases the joints."""

    def close(self) -> None:
        """Stop all motion and disable all joints."""


_guarded: WeakSet[Any] = WeakSet()
_replaced: dict[int, Any] = {}


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


def _exit(number: int, frame: FrameType | None) -> None:  # noqa: ARG001  the form of a handler
    # The status of a process that such a signal ended, for shells and supervisors.
    raise SystemExit(128 + number)


def _close_all() -> None:
    for robot in [*_guarded]:
        try:
            robot.close()
        except Exception as error:  # noqa: BLE001  the others are closed nevertheless
            sys.stderr.write(f"bioscara: at exit: {error}\n")
