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
    """Ends of motions that no call waits for; a thread of its own passes them to the handlers."""

    def __init__(self) -> None:
        self._ends: queue.SimpleQueue[tuple[int, str] | threading.Event] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None

    def prepare(self) -> None:
        """Start the thread, in a thread that may wait."""
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=self._pass_on, name="bioscara-log", daemon=True)
            self._thread.start()

    def add(self, level: int, text: str) -> None:
        """Log a text soon; returns at once."""
        self._ends.put((level, text))

    def flush(self) -> None:
        """Wait until the handlers have got everything, unless they take too long."""
        if self._thread is not None and self._thread.is_alive():
            passed = threading.Event()
            self._ends.put(passed)
            passed.wait(_PATIENCE)

    def _pass_on(self) -> None:
        while True:
            end = self._ends.get()
            if isinstance(end, threading.Event):
                end.set()
            else:
                log.log(*end)


_LATER = _Later()
flush = _LATER.flush


def called(name: str) -> None:
    """Log that an operation is requested."""
    log.info("%s called", name)


def refused(name: str, error: BaseException) -> None:
    """Log that a call was refused, so that nothing moved."""
    log.warning("%s refused: %s", name, error)


@contextmanager
def logged(operation: Running[Any], *, wait: bool) -> Iterator[None]:
    """Log the end of an operation, which is begun within the block, or that it was refused.

    Args:
        operation: The operation.
        wait: Whether it has ended at the end of the block.
    """
    waits = wait or not _configured()
    if not waits:
        _LATER.prepare()
    try:
        yield
    except BaseException as error:
        if operation.begun:
            log.log(*_end(operation.name, error))
        else:
            refused(operation.name, error)
        raise
    if wait:
        log.log(*_end(operation.name, operation.error))
    elif not waits:
        operation.when_done(lambda: _LATER.add(*_end(operation.name, operation.error)))


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
