"""Meaning of the exit status of a command."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """Exit status of every command."""

    OK = 0
    FAILED = 1
    """Something went wrong after the arm began to move, a joint is missing, or a file could
    not be written."""
    REFUSED = 2
    """Wrong usage, or refused with the reason before anything moved."""
    INTERRUPTED = 130
    """Ctrl-C, SIGTERM or SIGHUP; the arm was stopped and disabled."""
