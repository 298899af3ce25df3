"""The log of an owner and its gateways: a line an event, for people, the journal or programs."""

from __future__ import annotations

import json
import logging
import os
import sys
from collections import deque
from datetime import UTC, datetime

from bioscara.api.messages import LogLines
from bioscara.printing import printable
from bioscara.processes.unread_output import note_by
from bioscara.server.log_limit import LogLimit

_KEPT = 2000
"""Number of lines that are kept for clients."""
_PRIORITIES = {logging.CRITICAL: 2, logging.ERROR: 3, logging.WARNING: 4, logging.INFO: 6}
"""Priorities of syslog, which systemd's journal reads from the begin of a line."""


class _Lines(logging.Formatter):
    """A line for people; within a service with the priority of the journal."""

    def __init__(self, *, journal: bool) -> None:
        super().__init__()
        self._journal = journal

    def format(self, record: logging.LogRecord) -> str:
        """Return the line; further lines, as of a stack, are indented."""
        text = printable(record.getMessage())
        if record.exc_info:
            text += "\n  " + self.formatException(record.exc_info).replace("\n", "\n  ")
        if self._journal:
            priority = _PRIORITIES.get(record.levelno, 7)
            return "\n".join(f"<{priority}>{line}" for line in text.splitlines())
        time = datetime.fromtimestamp(record.created).astimezone()
        return f"{time:%H:%M:%S} {record.levelname.lower()}: {text}"


class _Json(logging.Formatter):
    """An object of JSON a line."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the object."""
        entry = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": printable(record.getMessage()),
        }
        if record.exc_info:
            entry["exception"] = self.formatException(record.exc_info)
        return json.dumps(entry)


class KeptLines(logging.Handler):
    """Keeps the latest lines for clients."""

    def __init__(self) -> None:
        super().__init__()
        self.setFormatter(_Lines(journal=False))
        self._kept: deque[tuple[int, str]] = deque(maxlen=_KEPT)
        self._last = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a line; called by any thread, one at a time."""
        self._last += 1
        self._kept.append((self._last, self.format(record)))

    def lines(self, after: int) -> LogLines:
        """Return the lines after a number."""
        kept = tuple(self._kept)
        return LogLines(self._last, tuple(line for number, line in kept if number > after))


kept = KeptLines()
"""The lines of this process."""


def set_up(*, as_json: bool, least: int = logging.INFO) -> None:
    """Let all loggers of this process write to the standard error stream, a few lines of a cause.

    Args:
        as_json: Whether to write JSON.
        least: Least level that is written; all from ``INFO`` on are kept.
    """
    handler = logging.StreamHandler(sys.stderr)
    handler.setLevel(least)
    journal = "JOURNAL_STREAM" in os.environ
    form = _Json() if as_json else _Lines(journal=journal)
    handler.setFormatter(form)
    note_by(lambda text: form.format(_warning(text)))
    root, limit = logging.getLogger(), LogLimit()
    for each in (handler, kept):
        each.filters[:] = [_is_no_robots, limit]
    root.handlers[:] = [handler, kept]
    root.setLevel(logging.INFO)


def _warning(text: str) -> logging.LogRecord:
    return logging.LogRecord(__name__, logging.WARNING, __file__, 0, text, None, None)


def _is_no_robots(record: logging.LogRecord) -> bool:
    # The owner has an event for all that its robot would tell.
    return record.name != "bioscara"
