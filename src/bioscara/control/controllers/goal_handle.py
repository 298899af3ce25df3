"""The common parts of all controllers' goals."""

from __future__ import annotations

from enum import StrEnum


class GoalStatus(StrEnum):
    """Status of a goal."""

    ACCEPTED = "accepted"
    EXECUTING = "executing"
    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELED = "canceled"


# A member of an enumeration takes longer to look up than to compare.
_ACCEPTED, _EXECUTING = GoalStatus.ACCEPTED, GoalStatus.EXECUTING


class AcceptedGoal:
    """A goal that a controller accepted.

    Attributes:
        status: Its status.
    """

    __slots__ = ()

    status: GoalStatus

    @property
    def done(self) -> bool:
        """Whether it ended."""
        return self.status is not _EXECUTING and self.status is not _ACCEPTED
