"""The rights that a client needs for a request."""

from __future__ import annotations

from enum import IntEnum


class Scope(IntEnum):
    """Rights of a credential; each includes the ones before it."""

    VIEW = 1
    """Look, plan, stop and pause."""
    OPERATE = 2
    """Take the lease and command the arm."""
    ADMIN = 3
    """Take the lease from another client; change parameters, controllers and hardware."""
