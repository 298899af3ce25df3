"""Goals of clients' trajectory controllers: planned from rest, checked, then followed.

A trajectory of a client may be too fast, jump, or lead into something. A goal whose whole motion
can be known before it begins is slowed down, averaged and checked, as are the trajectories that
the arm follows for its own operations; the controller then follows the result.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import NamedTuple, TypeVar

from bioscara.control.controllers.joint_trajectory import (
    Goal,
    GoalHandle,
    JointTrajectory,
    JointTrajectoryController,
    Point,
    PreparedGoal,
)
from bioscara.errors import BioscaraError, GoalRejectedError
from bioscara.planning import Trajectory
from bioscara.robot.arm import Arm
from bioscara.robot.operations.controllers.goal_course import (
    course_of,
    joined_points,
)
from bioscara.robot.runner import Runner
from bioscara.robot.workspace.workspace import Workspace

T = TypeVar("T")

_PATIENCE = 15.0
"""Longest time that a goal waits for the arm to come to rest [s]."""
_NOISE = 2e-3
"""Distance by which measured positions may differ from one cycle to another [rad or m]."""
_AT_REST = 1e-3
"""Share of its highest speed below which a joint counts as not moved."""
_SLOWER = 0.99
"""Share of the speed below which the log reports that a goal takes longer."""


class _Start(NamedTuple):
    """Where a goal begins.

    Attributes:
        positions: Of the joints, in the controller's order [rad or m].
        workspace: Workspace for which it is planned.
    """

    positions: tuple[float, ...]
    workspace: Workspace


class PlannedGoal:
    """A goal that is planned once the arm rests, and followed then.

    Created between two cycles.

    Args:
        runner: Runs the operations of the arm.
        controller: The controller; it accepts the goal.
        goal: The goal, prepared.

    Attributes:
        handle: The accepted goal.
        course: The trajectories that are carried out; empty before it begins.

    Raises:
        GoalRejectedError: The controller cannot follow it.
    """

    def __init__(
        self, runner: Runner, controller: JointTrajectoryController, goal: PreparedGoal
    ) -> None:
        self._runner, self._arm, self._controller, self._goal = runner, runner.arm, controller, goal
        self.handle: GoalHandle = controller.accept_goal(goal, self._arm.session.clock.now())
        self.course: tuple[Trajectory, ...] = ()

    def plan(self) -> None:
        """Plan the goal and begin it, or end it with the reason; in a thread of its own."""
        clock = self._arm.session.clock
        until = clock.now() + _PATIENCE
        try:
            while not self.handle.done:
                start = self._call(self._at_rest)
                if start is not None:
                    if self._call(partial(self._begin, start, *self._planned(start))):
                        return
                elif clock.now() > until:
                    raise GoalRejectedError(f"the arm did not come to rest in {_PATIENCE:g} s")
        except BioscaraError as error:
            self._refuse(str(error))
        except BaseException as error:
            self._refuse(repr(error))
            raise

    def _call(self, work: Callable[[], T]) -> T:
        return self._runner.between_cycles(f"a goal for {self._controller.name}", work)

    def _at_rest(self) -> _Start | None:
        """Return where the goal begins; None while the arm moves, or if it has ended."""
        controller = self._controller
        if self.handle.done or not controller.at_rest or moving_joint(self._arm) is not None:
            return None
        return _Start(controller.commanded, self._arm.workspace)

    def _planned(self, start: _Start) -> tuple[tuple[Trajectory, ...], PreparedGoal]:
        """Return the parts of the course, and that as a goal."""
        controller, names = self._controller, self._controller.parameters.joints
        asked = controller.arranged(self._goal.trajectory, start.positions)
        columns = [names.index(axis.name) for axis in self._arm.stack.hardware.axes]
        here = tuple([start.positions[column] for column in columns])
        points = [self._no_farther(_in_order(point, columns), here) for point in asked]
        self._require_reach(points[-1].positions, here)
        make = partial(course_of, points=points, here=here)
        course = self._arm.planning(make, start.workspace, here)
        trajectory = JointTrajectory(course[0].joint_names, joined_points(course))
        took, wanted = trajectory.points[-1].time, asked[-1].time
        return course, controller.prepare(
            Goal(trajectory, collision_checked=True), min(wanted / max(took, 1e-9), 1.0)
        )

    def _no_farther(self, point: Point, here: Sequence[float]) -> Point:
        """Return a point no farther beyond a limit than where the joints are.

        A joint that rests a little beyond one, as after homing, is sent to where it was measured,
        which differs by noise. The controller has refused any that is farther out.
        """
        hardware = self._arm.stack.hardware
        bounds = [hardware.limits[axis.name] for axis in hardware.axes]
        kept = [
            min(max(value, min(limits.lower, at)), max(limits.upper, at))
            for value, limits, at in zip(point.positions, bounds, here, strict=True)
        ]
        return point._replace(positions=tuple(kept))

    def _require_reach(self, ends: Sequence[float], here: Sequence[float]) -> None:
        """Raise if a joint whose velocity alone is commanded cannot get to the end of a goal.

        One that is nearer to its limit, as homing leaves it, may stay.
        """
        stack = self._arm.stack
        for axis, end, at in zip(stack.hardware.axes, ends, here, strict=True):
            limits, joint = (
                stack.hardware.limits[axis.name],
                stack.manager.limiter.joints[axis.name],
            )
            kept = joint.distance_kept(stack.loop.period)
            lower, upper = min(limits.lower + kept, at), max(limits.upper - kept, at)
            tolerance = self._controller.parameters.constraints.of(axis.name).goal
            if kept > tolerance and not lower - tolerance <= end <= upper + tolerance:
                raise GoalRejectedError(
                    f"{axis.name} ends at {end:.4f} {limits.unit}; under velocities alone it gets "
                    f"to {lower:.4f} .. {upper:.4f} {limits.unit}: end within these, or use a "
                    "controller of positions"
                )

    def _begin(self, start: _Start, course: tuple[Trajectory, ...], goal: PreparedGoal) -> bool:
        """Begin it where it was planned; return whether that, or its end, is done."""
        now = self._at_rest()
        if self.handle.done:
            return True
        if (
            now is None
            or now.workspace is not start.workspace
            or math.dist(now.positions, start.positions) > _NOISE
        ):
            return False
        controller, speed = self._controller, goal.trajectory.speed
        if speed < _SLOWER:
            took = goal.goal.trajectory.points[-1].time
            self._arm.warn(
                f"the goal takes {took:.2f} s instead of {speed * took:.2f} s, as the speed is "
                "limited and jumps are averaged",
                controller.name,
            )
        controller.begin(self.handle, goal, self._arm.session.clock.now())
        self.course = course
        return True

    def _refuse(self, reason: str) -> None:
        # Where the arm has ended meanwhile, so has the goal.
        with suppress(BioscaraError):
            self._call(lambda: self._controller.refuse(self.handle, reason))


def moving_joint(arm: Arm) -> str | None:
    """Return the name of a joint of the arm that is commanded to move; None if there is none.

    The residual velocities of a control loop do not count.
    """
    joints = arm.stack.manager.limiter.joints.items()
    return next(
        (
            name
            for name, joint in joints
            if joint.commanded and abs(joint.speed) > _AT_REST * joint.max_velocity
        ),
        None,
    )


def can_be_planned(arm: Arm, controller: JointTrajectoryController, goal: PreparedGoal) -> bool:
    """Return whether the whole motion of a goal is known before it begins.

    It is not where the goal has a stamp, the controller lacks joints of the arm or outputs points
    without a curve between them, or points have different fields.
    """
    parameters, trajectory = controller.parameters, goal.goal.trajectory
    given = {tuple(map(bool, point[1:])) for point in trajectory.points}
    return (
        not trajectory.stamp
        and {axis.name for axis in arm.stack.hardware.axes} == set(parameters.joints)
        and parameters.interpolation_method == "splines"
        and len(given) == 1
    )


def _in_order(point: Point, columns: Sequence[int]) -> Point:
    """Return a point with its values in another order."""
    fields = [tuple([values[each] for each in columns]) if values else () for values in point[1:4]]
    return Point(point.time, *fields)
