"""Following of trajectories, planned here or elsewhere."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

from bioscara.arguments import flag
from bioscara.control.controllers.joint_trajectory import Goal, JointTrajectory, PreparedGoal
from bioscara.errors import InvalidArgumentError, TrajectoryError
from bioscara.planning import Trajectory
from bioscara.report import Phase
from bioscara.robot.arm import Arm
from bioscara.robot.connection.stack import TRAJECTORY
from bioscara.robot.operations.execution import MotionExecution, ready
from bioscara.robot.operations.operation import Cycles, OnCycle, Operation
from bioscara.robot.planner import Plan, Planner

START_TOLERANCE = {"rad": math.radians(1.0), "m": 2e-3}
"""Largest offset of the arm from a trajectory's start; a ramp leads from there to the start."""
_AT_START = 1e-4
"""Offset [rad or m] up to which the arm counts as being at the start of a trajectory."""

MakePlan = Callable[[Planner], Plan]
"""Plans a motion from where the arm is."""


class FollowTrajectory(Operation[None]):
    """Follows a planned trajectory, after a ramp to its start where that is elsewhere.

    Args:
        name: Name for messages, such as ``"move_linear()"``.
        plan: Plans the motion, once the arm is claimed; nothing else moves it from then on.
        approach: Whether to move to its start from any position of the arm.
        timeout: Longest duration [s]; None for no limit.
        on_cycle: Receives the record of each cycle.

    Attributes:
        plan: The plan, from the begin on; None before.
    """

    pausable = _needs_confirmed_scene = True

    def __init__(
        self,
        name: str,
        plan: MakePlan,
        *,
        approach: bool = False,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
    ) -> None:
        super().__init__(name, timeout=timeout, on_cycle=on_cycle)
        self._make_plan: MakePlan | None = plan
        self._approach = flag("approach", approach)
        self.plan: Plan | None = None
        self._goals: list[tuple[PreparedGoal, Phase, float]] = []
        self._ramp: Trajectory | None = None
        self._execution: MotionExecution | None = None

    @property
    def paths(self) -> list[Trajectory]:
        """The trajectories that the arm follows: the ramp to the start, if any, and the plan's."""
        planned = [] if self.plan is None else [self.plan.trajectory]
        return planned if self._ramp is None else [self._ramp, *planned]

    @property
    def notes(self) -> tuple[str, ...]:
        """Those of its plan."""
        return () if self.plan is None else self.plan.notes

    @property
    def progress(self) -> float:
        """Share of the planned time that has passed on the trajectory, 0 to 1."""
        if self.done and self.error is None:
            return 1.0
        if self.plan is None or self._execution is None:
            return 0.0
        return min(self._execution.elapsed / max(self.plan.trajectory.duration, 1e-9), 1.0)

    def prepare(self, arm: Arm) -> None:
        """Plan the motion and a ramp to its start."""
        make_plan = self._make_plan
        assert make_plan is not None  # noqa: S101  an operation is begun once
        make = partial(_planned, make_plan, approach=self._approach)
        plan, self._ramp = arm.planning(make, arm.workspace, arm.positions())
        trajectory = plan.trajectory
        # Last: with a plan, all paths are known, and jaws that begin to move are checked on them.
        self.plan = plan
        # Here, as a cycle that had to do this would be late.
        prepared = arm.stack.trajectory.prepare
        if self._ramp is not None:
            ramp = prepared(_goal(self._ramp))
            self._goals.append((ramp, Phase.APPROACH, self._ramp.duration))
        self._goals.append((prepared(_goal(trajectory)), Phase.TRAJECTORY, 0.0))
        if (remedy := arm.pause_remedy(self)) is not None:
            arm.warn(f"{self.name} begins paused: it moves after {remedy}", self.name)

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Follow the ramp, then the trajectory."""
        stack, clock = arm.stack, arm.session.clock
        yield from ready(arm, self)
        stack.use(TRAJECTORY, clock.now())
        execution = MotionExecution(arm, self)
        for goal, phase, until_start in self._goals:
            self._execution = execution if phase is Phase.TRAJECTORY else None
            yield from execution.follow(goal, phase, until_start)

    def _end(self, error: BaseException | None) -> None:
        super()._end(error)
        # A thousand operations may be kept, with a thousand points each.
        self._goals, self._make_plan = [], None

    def forget(self) -> None:
        """Drop the plan and its trajectories too."""
        super().forget()
        self.plan = self._ramp = None


def _planned(
    make_plan: MakePlan, planner: Planner, *, approach: bool
) -> tuple[Plan, Trajectory | None]:
    """Return a plan, and a ramp from the arm to its start; None if the arm is there."""
    plan = make_plan(planner)
    here, start = planner.here(), start_of(plan.trajectory, planner)
    if not approach:
        _require_near(here, start, planner)
    if max(abs(a - b) for a, b in zip(here, start, strict=True)) <= _AT_START:
        return plan, None
    return plan, planner.move_joints(start).trajectory


def checked(trajectory: Trajectory, planner: Planner, *, planned: bool = False) -> Plan:
    """Return a plan of a trajectory, checked against the current tool, speed limit and scene.

    Args:
        trajectory: Trajectory of some or all joints.
        planner: Planner of the arm.
        planned: Whether it was planned here before.

    Raises:
        InvalidArgumentError: It is no trajectory.
        TrajectoryError: The trajectory exceeds a limit.
        ZoneError: Its path is not free.
    """
    if not isinstance(trajectory, Trajectory):
        raise InvalidArgumentError(
            f"follow() takes a Trajectory, not a {type(trajectory).__name__}; execute() takes a "
            "Plan or a Trajectory"
        )
    return planner.check_trajectory(trajectory, start_of(trajectory, planner), planned=planned)


def start_of(trajectory: Trajectory, planner: Planner) -> list[float]:
    """Return all joint positions at the start of a trajectory of some or all joints.

    Those of joints that the arm does not have are left to the check of the trajectory.
    """
    here = dict(zip(planner.joint_names, planner.here(), strict=True))
    first = dict(zip(trajectory.joint_names, trajectory.positions[0].tolist(), strict=True))
    return [first.get(name, position) for name, position in here.items()]


def _goal(trajectory: Trajectory) -> Goal:
    return Goal(JointTrajectory.of(trajectory), collision_checked=True)


def _require_near(here: Sequence[float], start: Sequence[float], planner: Planner) -> None:
    for joint, current, first in zip(planner.workspace.parameters.joints, here, start, strict=True):
        limit = START_TOLERANCE[joint.unit]
        if abs(first - current) > limit:
            raise TrajectoryError(
                f"{joint.name} is at {current:.4f} {joint.unit} and the trajectory starts at "
                f"{first:.4f}: more than {limit:.4f} {joint.unit} apart; move_joints() there "
                "first, or follow(..., approach=True)"
            )
