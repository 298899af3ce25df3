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

    Each call plans first, checks limits and zones, and moves only then; ``warnings`` have what the
    person should know about the plan. What it would do without moving is in ``plan``:
    ``robot.plan.linear(pose)`` and so on.

    Attributes:
        plan: Plans from where the arm is.
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
        """Carry a plan out; part of a call that uses the arm alone."""

    @exclusive("move_to()")
    def move_to(self, pose: Pose, speed: float = 1.0) -> None:
        """Move to a pose by the joints' shortest way.

        Args:
            pose: Where the tool shall be.
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            UnreachableError: The arm cannot take the pose; nothing moved.
            ZoneError: The way leads through something; nothing moved.
            BioscaraError: As ``follow``.
        """
        self._carry_out(self.plan.to(pose, speed))

    @exclusive("move_linear()")
    def move_linear(self, pose: Pose, speed: float = 1.0) -> None:
        """Move to a pose along a line; arguments and errors as :meth:`move_to`."""
        self._carry_out(self.plan.linear(pose, speed))

    @exclusive("move_circular()")
    def move_circular(self, via: Pose, pose: Pose, speed: float = 1.0) -> None:
        """Move to a pose along an arc through ``via``; the rest as :meth:`move_to`."""
        self._carry_out(self.plan.circular(via, pose, speed))

    @abstractmethod
    def jog(
        self,
        velocities: Callable[[], Velocity | None],
        observe: Observe = ignore,
        *,
        timeout: float | None = None,
    ) -> None:
        """Move by streamed velocities until there are no more; the arm is then at rest.

        Joint limits, the tool's speed and zones are kept, with room to come to rest in front of
        them. Of what is asked for the arm does the share ``speed``. A source that does not answer
        within 0.15 s lets the arm come to rest.

        Args:
            velocities: Asked each cycle: a velocity of the joints or of the tool, the one before
                again for as long as it holds, or None to end.
            observe: Takes a record of all joints each cycle.
            timeout: Longest time that it may take [s]; None for no bound.

        Raises:
            InvalidArgumentError: A velocity is not finite or too large; the arm is at rest.
            TrajectoryError: A joint was pushed beyond a limit; nothing moved.
            ZoneError: The arm is too near to something; nothing moved.
            BioscaraError: As ``follow``.
        """

    @exclusive("move_named()")
    def move_named(self, name: str, speed: float = 1.0) -> None:
        """Move to a pose of the teach table; the rest as :meth:`move_to`.

        Args:
            name: Of the pose.
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            InvalidArgumentError: No pose has that name, or it was taught with another tool.
        """
        self._carry_out(self.plan.named(name, speed))

    @exclusive("unfold()")
    def unfold(self, speed: float = 1.0) -> None:
        """Open the elbow alone, j3 to 0: the way out of an arm that homing left folded up.

        Args:
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            NotHomedError: A joint does not know where it is.
            ZoneError: The way leads through something; nothing moved.
        """
        self._carry_out(self.plan.unfold(speed))

    @exclusive("move_sequence()")
    def move_sequence(self, waypoints: Sequence[Waypoint]) -> None:
        """Move along waypoints with rounded corners; errors as :meth:`move_to`."""
        self._carry_out(self.plan.sequence(waypoints))
