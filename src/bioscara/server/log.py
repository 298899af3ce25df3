"""The log of an owner and its gateways: a line an event, for people, the journal or programs."""

from __future__ import annotations

import json
import logging
import os
import sys
from datetime import UTC, datetime

from bioscara.printing import printable

_PRIORITIES = {logging.CRITICAL: 2, logging.ERROR: 3, logging.WARNING: 4, logging.INFO: 6}
"""Priorities of syslog, which systemd's journal reads from the begin of a line."""


class _Lines(logging.Formatter):
    """A line for people; within a service with the priority of the journal."""

    def __init__(self) -> None:
        super().__init__()
        self._journal = "JOURNAL_STREAM" in os.environ

    def format(self, record: logging.LogRecord) -> str:
        """Return the line; what follows it, as a stack, is indented."""
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


def set_up(*, as_json: bool) -> None:
    """Let all loggers of this process write to the standard error stream.

    Args:
        as_json: Whether to write JSON.
    """
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_Json() if as_json else _Lines())
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(logging.INFO)
