"""Motions to poses, for the robot."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

from bioscara.kinematics import Pose
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.robot.call_arbiter import CallArbiter, exclusive
from bioscara.robot.planner import Plan, Planner
from bioscara.robot.records import Cancelled, Observe, ignore, never

Velocity = JointVelocity | ToolVelocity


class PoseMotions(ABC):
    """Moves the tool; poses are of the tool in the base.

    Each call plans first, checks limits and zones, and only then moves; ``warnings`` have the
    notes on the plan for the user. ``plan`` plans the same motions without moving:
    ``robot.plan.linear(pose)`` and so on.

    Attributes:
        plan: Plans motions from the arm's current position.
    """

    plan: Planner
    _turn: CallArbiter

    @abstractmethod
    def _carry_out(
        self,
        plan: Plan,
        observe: Observe = ignore,
        cancelled: Cancelled = never,
        timeout: float | None = None,
    ) -> None:
        """Execute a plan; part of a call that uses the arm exclusively."""

    @exclusive("move_to()")
    def move_to(self, pose: Pose, speed: float = 1.0) -> None:
        """Move to a pose by the closest joint solution.

        Args:
            pose: Goal pose of the tool.
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            UnreachableError: The arm cannot reach the pose; nothing moved.
            ZoneError: The path is not free; nothing moved.
            BioscaraError: As ``follow``.
        """
        self._carry_out(self.plan.to(pose, speed))

    @exclusive("move_linear()")
    def move_linear(self, pose: Pose, speed: float = 1.0) -> None:
        """Move to a pose along a line; arguments and errors as :meth:`move_to`."""
        self._carry_out(self.plan.linear(pose, speed))

    @exclusive("move_circular()")
    def move_circular(self, via: Pose, pose: Pose, speed: float = 1.0) -> None:
        """Move to a pose along an arc through ``via``; otherwise as :meth:`move_to`."""
        self._carry_out(self.plan.circular(via, pose, speed))

    @abstractmethod
    def jog(
        self,
        velocities: Callable[[], Velocity | None],
        observe: Observe = ignore,
        *,
        timeout: float | None = None,
    ) -> None:
        """Move by streamed velocities until the stream ends; the arm is then at rest.

        Joint limits, the tool's speed limit and zones are respected, with enough distance to stop
        before them. Commanded velocities are scaled by ``speed``. If the source does not answer
        within 0.15 s, the arm comes to rest.

        Args:
            velocities: Called each cycle: returns a velocity of the joints or of the tool, the
                previous one as long as it holds, or None to end.
            observe: Receives a record of all joints each cycle.
            timeout: Longest duration [s]; None for no limit.

        Raises:
            InvalidArgumentError: A velocity is not finite or too large; the arm is at rest.
            TrajectoryError: A joint was pushed beyond a limit; nothing moved.
            ZoneError: The arm's clearance is too small; nothing moved.
            BioscaraError: As ``follow``.
        """

    @exclusive("move_named()")
    def move_named(self, name: str, speed: float = 1.0) -> None:
        """Move to a pose of the teach table; otherwise as :meth:`move_to`.

        Args:
            name: Name of the pose.
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            InvalidArgumentError: No pose has that name, or it was taught with another tool.
        """
        self._carry_out(self.plan.named(name, speed))

    @exclusive("unfold()")
    def unfold(self, speed: float = 1.0) -> None:
        """Open the elbow alone, j3 to 0, so that an arm left folded up by homing can move freely.

        Args:
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            NotHomedError: The position of a joint is unknown.
            ZoneError: The path is not free; nothing moved.
        """
        self._carry_out(self.plan.unfold(speed))

    @exclusive("move_sequence()")
    def move_sequence(self, waypoints: Sequence[Waypoint]) -> None:
        """Move along waypoints with rounded corners; errors as :meth:`move_to`."""
        self._carry_out(self.plan.sequence(waypoints))
