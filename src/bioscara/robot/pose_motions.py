"""Motions to poses, for the robot."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

from bioscara.kinematics import Pose
from bioscara.planning.sequence import Waypoint
from bioscara.robot.planner import Plan, Planner
from bioscara.robot.records import Cancelled, Observe, ignore, never


class PoseMotions(ABC):
    """Moves the tool; poses are of the tool in the base.

    Each call plans first, checks limits and zones, and moves only then. What it would do without
    moving is in ``plan``: ``robot.plan.linear(pose)`` and so on.

    Attributes:
        plan: Plans from where the arm is.
    """

    plan: Planner

    @abstractmethod
    def execute(
        self,
        plan: Plan,
        observe: Observe = ignore,
        cancelled: Cancelled = never,
        *,
        timeout: float | None = None,
    ) -> None:
        """Carry a plan out."""

    def move_to(self, pose: Pose, speed: float = 1.0) -> None:
        """Move to a pose by the joints' shortest way.

        Args:
            pose: Where the tool shall be.
            speed: Share of the speed limits to use, above 0 and at most 1.

        Raises:
            UnreachableError: The arm cannot take the pose; nothing moved.
            ZoneError: The way leads through something; nothing moved.
            BioscaraError: As ``follow``.
        """
        self.execute(self.plan.to(pose, speed))

    def move_linear(self, pose: Pose, speed: float = 1.0) -> None:
        """Move to a pose along a line; arguments and errors as :meth:`move_to`."""
        self.execute(self.plan.linear(pose, speed))

    def move_circular(self, via: Pose, pose: Pose, speed: float = 1.0) -> None:
        """Move to a pose along an arc through ``via``; the rest as :meth:`move_to`."""
        self.execute(self.plan.circular(via, pose, speed))

    def move_sequence(self, waypoints: Sequence[Waypoint]) -> None:
        """Move along waypoints with rounded corners; errors as :meth:`move_to`."""
        self.execute(self.plan.sequence(waypoints))
