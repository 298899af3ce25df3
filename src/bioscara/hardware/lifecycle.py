"""States that hardware components and controllers share, with ros2_control's numbers."""

from __future__ import annotations

from enum import IntEnum


class State(IntEnum):
    """Where a component or controller is in its life; the numbers are those of lifecycle_msgs."""

    UNKNOWN = 0
    UNCONFIGURED = 1
    INACTIVE = 2
    ACTIVE = 3
    FINALIZED = 4

    @property
    def label(self) -> str:
        """The name that ROS messages carry, in lower case."""
        return self.name.lower()
