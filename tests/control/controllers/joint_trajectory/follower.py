"""A trajectory controller on the simulated arm, and its commands from cycle to cycle."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

from bioscara.control.controllers.joint_trajectory import (
    Goal,
    GoalHandle,
    JointTrajectory,
    JointTrajectoryController,
    Point,
)
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import (
    JointTrajectoryParameters,
)
from bioscara.hardware import CommandInterface, StateInterface
from control.control_stack import BOTH, LIMITS, NAMES, World

MIDDLE = {"j1": 0.1, "j2": 0.15, "j3": 0.2, "j4": -0.1}
"""Positions of the joints at the begin of every test [rad or m]."""
NOTHING = (0.0,) * 4
BRAKES = {
    "decelerate_on_cancel": True,
    **{name: {"max_deceleration_on_cancel": LIMITS[name].max_acceleration} for name in NAMES},
}
TYPE = "joint_trajectory_controller/JointTrajectoryController"


class Seen(NamedTuple):
    """One cycle.

    Attributes:
        time: Its begin [s].
        positions: Commands [rad or m].
        velocities: Commands [rad/s or m/s].
        measured: Positions [rad or m].
    """

    time: float
    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    measured: tuple[float, ...]


class Follower:
    """Wraps one controller under test; ``close`` leaves the arm at rest in the middle."""

    def __init__(self, world: World, **parameters: Any) -> None:
        self.world, self.clock = world, world.clock
        # Without the wait for rest, which has tests of its own: ends are exact to a cycle then.
        constraints = {"stopped_time": 0.0, **parameters.pop("constraints", {})}
        parameters = {
            "joints": NAMES, "command_interfaces": BOTH, "constraints": constraints, **parameters,
        }  # fmt: skip
        self.jtc: JointTrajectoryController = world.load("jtc", TYPE, **parameters)
        self.seen: list[Seen] = []
        world.switch("jtc")
        self.run(0.03)

    @property
    def now(self) -> float:
        return self.clock.now()

    @property
    def commanded(self) -> tuple[float, ...]:
        return tuple(axis.position_command.value for axis in self.world.hardware.axes)

    @property
    def measured(self) -> tuple[float, ...]:
        return tuple(axis.position.value for axis in self.world.hardware.axes)

    @property
    def interventions(self) -> int:
        return sum(guard.interventions for guard in self.world.manager.limiter.joints.values())

    def step(self) -> Seen:
        cycle = self.world.loop.step()
        axes = self.world.hardware.axes
        velocities = tuple(axis.velocity_command.value for axis in axes)
        self.seen.append(Seen(cycle.time, self.commanded, velocities, self.measured))
        return self.seen[-1]

    def run(self, seconds: float) -> list[Seen]:
        return [self.step() for _ in range(round(seconds * self.world.rate))]

    def finish(self, handle: GoalHandle, seconds: float = 30.0) -> GoalHandle:
        for _ in range(round(seconds * self.world.rate)):
            if handle.done:
                return handle
            self.step()
        raise AssertionError(f"goal not done within {seconds} s: {handle}")

    def trajectory(
        self, *points: Point, names: tuple[str, ...] = NAMES, stamp: float = 0.0
    ) -> JointTrajectory:
        return JointTrajectory(names, points, stamp)

    def send(self, *points: Point, stamp: float = 0.0, **tolerances: Any) -> GoalHandle:
        return self.jtc.send_goal(
            Goal(self.trajectory(*points, stamp=stamp), **tolerances), self.now
        )

    def move(self, displacement: float = 0.1, seconds: float = 1.0, *, rest: bool = True) -> Point:
        """Return a point displaced from the last command, j1 to j4 in their proportions."""
        positions = tuple(
            at + displacement * share
            for at, share in zip(self.commanded, (1, 0.05, 1, 1), strict=True)
        )
        return Point(seconds, positions, NOTHING if rest else ())

    def close(self) -> None:
        world = self.world
        if self.jtc.state == 3:
            world.switch(off=("jtc",))
        world.manager.unload("jtc")
        world.run(0.6)
        world.go(MIDDLE)


def alone(
    kinds: tuple[str, ...], **values: Any
) -> tuple[JointTrajectoryController, list[StateInterface], list[StateInterface]]:
    """Return a bound controller of the joints a and b, its position and its velocity states."""
    values = {"joints": ("a", "b"), "command_interfaces": kinds, **values}
    jtc = JointTrajectoryController("jtc", JointTrajectoryParameters.read("jtc", values))
    jtc.on_configure()
    jtc.nominal_period = 0.01
    positions, velocities = (
        [StateInterface(joint, kind) for joint in ("a", "b")] for kind in ("position", "velocity")
    )
    jtc.bind(
        {f"{joint}/{kind}": CommandInterface(joint, kind) for kind in kinds for joint in "ab"},
        {state.name: state for state in (*positions, *velocities)},
    )
    return jtc, positions, velocities


def smooth(arm: Follower, after: float, *, limited: bool = False) -> None:
    """Assert that commands kept the limits and were continuous since ``after`` [s].

    Args:
        arm: The follower that ran.
        after: Begin of the checked time [s].
        limited: Whether the limiter shaped the positions: then velocities fit them only where it
            does, and the only requirement is that neither passes its limit.
    """
    begin = next(index for index, each in enumerate(arm.seen) if each.time >= after)
    seen = arm.seen[max(begin - 2, 0) :]
    for index, name in enumerate(NAMES):
        fastest, most = 1.001 * LIMITS[name].max_velocity, 1.01 * LIMITS[name].max_acceleration
        mean_before = (seen[1].positions[index] - seen[0].positions[index]) / (
            seen[1].time - seen[0].time
        )
        for one, two in pairwise(seen[1:]):
            period = two.time - one.time
            mean = (two.positions[index] - one.positions[index]) / period
            assert abs(mean) <= fastest
            assert abs(mean - mean_before) <= 1.5 * most * period + 1e-9
            assert abs(two.velocities[index]) <= fastest
            assert limited or abs(two.velocities[index] - mean) <= most * period + 1e-9
            mean_before = mean
