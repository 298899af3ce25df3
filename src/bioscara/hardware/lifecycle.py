"""States that hardware components and controllers share, with ros2_control's numbers."""

from __future__ import annotations

from enum import IntEnum


class State(IntEnum):
    """Lifecycle state of a component or controller; the numbers are those of lifecycle_msgs."""

    UNKNOWN = 0
    UNCONFIGURED = 1
    INACTIVE = 2
    ACTIVE = 3
    FINALIZED = 4

    @property
    def label(self) -> str:
        """The name used in ROS messages, in lower case."""
        return self.name.lower()
