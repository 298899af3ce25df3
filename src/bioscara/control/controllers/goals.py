"""What the goals of all controllers have in common."""

from __future__ import annotations

from enum import Enum


class Status(Enum):
    """How far a goal got."""

    EXECUTING = "executing"
    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELED = "canceled"


class Pursued:
    """A goal that a controller accepted.

    Attributes:
        status: How far it got.
    """

    __slots__ = ()

    status: Status

    @property
    def done(self) -> bool:
        """Whether it ended."""
        return self.status is not Status.EXECUTING
