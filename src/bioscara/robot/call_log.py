"""What a robot tells the logger ``bioscara``: calls, their ends and refusals.

Nothing is printed unless the program configures logging. A handler may be slow: none is called by
the thread that runs the control loop while something moves.
"""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from bioscara.errors import MotionCancelledError
from bioscara.robot.operations.running import Running

log = logging.getLogger("bioscara")
log.addHandler(logging.NullHandler())

_PATIENCE = 1.0
"""Longest time for which a robot that is closed waits for handlers [s]."""


class _Later:
    """Texts that a thread of its own passes to the handlers, as they come from a control loop."""

    def __init__(self) -> None:
        self._texts: queue.SimpleQueue[tuple[int, str] | threading.Event] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None

    def add(self, level: int, text: str) -> None:
        """Log a text soon; returns at once."""
        if not _configured():
            return
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=self._pass_on, name="bioscara-log", daemon=True)
            self._thread.start()
        self._texts.put((level, text))

    def flush(self) -> None:
        """Wait until the handlers have got everything, unless they take too long."""
        if self._thread is not None and self._thread.is_alive():
            passed = threading.Event()
            self._texts.put(passed)
            passed.wait(_PATIENCE)

    def _pass_on(self) -> None:
        while True:
            text = self._texts.get()
            if isinstance(text, threading.Event):
                text.set()
            else:
                log.log(*text)


_LATER = _Later()
flush = _LATER.flush


def called(name: str, *, in_loop: bool = False) -> None:
    """Log that an operation is requested, after the ends of those before it.

    Args:
        name: Its call.
        in_loop: Whether this thread runs a control loop, as in a callback of a motion.
    """
    _tell(logging.INFO, f"{name} called", in_loop=in_loop)


def refused(name: str, error: BaseException, *, in_loop: bool = False) -> None:
    """Log that a call was refused, so that nothing moved; arguments as :func:`called`."""
    _tell(logging.WARNING, f"{name} refused: {error}", in_loop=in_loop)


@contextmanager
def logged(operation: Running[Any], *, wait: bool, in_loop: bool = False) -> Iterator[None]:
    """Log the end of an operation, which is begun within the block, or that it was refused.

    Args:
        operation: The operation.
        wait: Whether it has ended at the end of the block.
        in_loop: As of :func:`called`.
    """
    try:
        yield
    except BaseException as error:
        if operation.begun:
            _tell(*_end(operation.name, error), in_loop=in_loop)
        else:
            refused(operation.name, error, in_loop=in_loop)
        raise
    if wait:
        _tell(*_end(operation.name, operation.error), in_loop=in_loop)
    else:
        operation.when_done(lambda: _LATER.add(*_end(operation.name, operation.error)))


def _tell(level: int, text: str, *, in_loop: bool) -> None:
    if in_loop:
        _LATER.add(level, text)
    else:
        flush()
        log.log(level, "%s", text)


def _end(name: str, error: BaseException | None) -> tuple[int, str]:
    """Return the level and the text of an end."""
    if error is None:
        return logging.INFO, f"{name} succeeded"
    if isinstance(error, MotionCancelledError):
        return logging.WARNING, f"{name} cancelled: {error}"
    return logging.ERROR, f"{name} failed: {error or type(error).__name__}"


def _configured() -> bool:
    """Return whether any handler takes the texts."""
    logger: logging.Logger | None = log
    while logger is not None:
        if any(not isinstance(each, logging.NullHandler) for each in logger.handlers):
            return True
        logger = logger.parent if logger.propagate else None
    return False
