"""A limit of how many lines of one cause are written to a log."""

from __future__ import annotations

import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

LINES, PERIOD = 20, 10.0
"""Warnings or errors of one cause that are written in a time [s]."""
REPORTS = 500
"""Likewise other lines: the events of an arm at work are of one place in the program."""
_CAUSES = 256
"""Causes that are remembered."""


@dataclass(slots=True)
class _Cause:
    begin: float
    count: int = 0
    omitted: int = 0


class LogLimit(logging.Filter):
    """Leaves out further lines of the same place in the program; says how many, once in a time.

    Several handlers may share it: each record is judged once.

    Args:
        clock: Returns the time [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._clock, self._deciding = clock, threading.Lock()
        self._causes: OrderedDict[tuple[str, int], _Cause] = OrderedDict()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether a record is written."""
        with self._deciding:
            kept = vars(record)
            if "within_limit" not in kept:
                kept["within_limit"] = self._decide(record)
            return bool(kept["within_limit"])

    def _decide(self, record: logging.LogRecord) -> bool:
        place, now = (record.pathname, record.lineno), self._clock()
        cause = self._causes.setdefault(place, _Cause(now))
        self._causes.move_to_end(place)
        while len(self._causes) > _CAUSES:
            self._causes.popitem(last=False)
        omitted = 0
        if now - cause.begin >= PERIOD:
            omitted = cause.omitted
            cause.begin, cause.count, cause.omitted = now, 0, 0
        cause.count += 1
        most = LINES if record.levelno >= logging.WARNING else REPORTS
        if cause.count > most:
            cause.omitted += 1
            return False
        notes = []
        if omitted:
            notes.append(f"and {omitted} more like it before")
        if cause.count == most:
            notes.append(f"further ones like it are left out for {PERIOD:g} s")
        if notes:
            record.msg, record.args = f"{record.getMessage()} ({'; '.join(notes)})", ()
        return True
