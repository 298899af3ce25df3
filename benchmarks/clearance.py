"""Keeping the arm clear of its surroundings: cost in each cycle, and of clearances at once."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from time import perf_counter
from typing import ClassVar

import numpy as np

from benchmarks.control import homed_stack
from benchmarks.floors import cycle as bare_cycle
from benchmarks.measure import Row, at_most, duration, medians, timed
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.controllers.joint_trajectory import Goal, JointTrajectory, Point
from bioscara.control.limits.limiter import CommandSource, Property
from bioscara.model import load_parameters
from bioscara.planning.collision.scene import Box, Scene
from bioscara.planning.limits import REDUCED_SPEED
from bioscara.robot.connection.stack import TRAJECTORY, Stack
from bioscara.robot.workspace.workspace import Workspace

CYCLES = 3000
_PROVEN, _FREE, _NEAR = 0.2, 10, 40
"""Limits of the median, in bare cycles."""
SAMPLES, _SAMPLED = 1000, 200
"""Positions of the arm whose clearance is computed together, and the limit, in distances of as many
points from the zones."""
_START = (0.3, 0.2, 0.8, -0.5)
_ZONES = tuple(
    Box(f"zone_{i}", (-0.5 + 0.2 * i, 0.66, 0.0), (-0.35 + 0.2 * i, 0.9, 0.4)) for i in range(6)
)
_TO_AND_FRO, _INTO = (0.4, 0.02, 0.4, 0.8), (0.6, 0.02, 0.2, 0.4)


def _proven(stack: Stack) -> tuple[float, float]:
    """Return the cost of the stage after a collision-checked trajectory, and a bare cycle [s]."""
    stage = stack.collision_guard

    def stages() -> None:
        stage.prepare(0.01, ())
        stage.apply(0.01, ())

    own, bare = medians(stages, bare_cycle(), rounds=15, number=(20_000, 1000))
    return own, bare


def _streamed(stack: Stack, swing: Sequence[float]) -> tuple[list[float], float]:
    """Return sorted costs of the cycles of a swinging stream and the median of a bare cycle [s]."""
    forward = stack.manager.controller("stream")
    if not isinstance(forward, ForwardCommandController):
        raise TypeError(type(forward).__name__)
    guard, smoothing, costs = stack.collision_guard, stack.smoothing, []
    begin, bare, run = 0.0, [], bare_cycle()

    class Timed:
        CONCERNS: ClassVar[Property] = "collision_checked"

        def prepare(self, period: float, unchecked: Sequence[CommandSource]) -> None:
            nonlocal begin
            start = perf_counter()
            smoothing.prepare(period, unchecked)
            guard.prepare(period, unchecked)
            begin = perf_counter() - start

        def apply(self, period: float, unchecked: Sequence[CommandSource]) -> None:
            start = perf_counter()
            guard.apply(period, unchecked)
            smoothing.apply(period, unchecked)
            costs.append(begin + perf_counter() - start)

    limiter = stack.manager.limiter
    before, limiter.stages = limiter.stages, (stack.tool_speed, Timed())
    for cycle in range(CYCLES):
        share = abs(math.sin(math.pi * cycle / 1500.0))
        forward.command([a + share * b for a, b in zip(_START, swing, strict=True)])
        stack.loop.step()
        bare.append(timed(run))
    limiter.stages = before
    if stack.supervisor.faults:
        raise RuntimeError(str(stack.supervisor.faults[0]))
    return sorted(costs), statistics.median(bare)


def _sampled(workspace: Workspace) -> Row:
    """Measure the clearance of many positions of the arm next to zones, computed together."""
    rng = np.random.default_rng(1)
    lower, upper = np.array([(each.lower, each.upper) for each in workspace.kinematics.limits]).T
    joints = rng.uniform(lower, upper, (SAMPLES, len(lower)))
    points = rng.uniform(-1.0, 1.0, (SAMPLES, 1, 3))
    corners = np.array([(zone.lower, zone.upper) for zone in _ZONES])
    scene = Scene(_ZONES, 0.0)

    def distances() -> np.ndarray:
        outside = np.maximum(np.maximum(corners[:, 0] - points, points - corners[:, 1]), 0.0)
        return np.linalg.norm(outside, axis=2).min(axis=1)

    own, bare = medians(
        lambda: scene.clearance(workspace.kinematics, joints), distances, rounds=15, number=(1, 50)
    )
    return at_most(
        f"clearance of {SAMPLES} positions of the arm from six zones",
        own,
        _SAMPLED,
        bare,
        f"numpy, distance of {SAMPLES} points from the zones",
    )


def rows() -> list[Row]:
    """Measure a collision-checked trajectory, and a raw stream in free space and next to zones."""
    workspace = Workspace.of(load_parameters())
    stack, clock = homed_stack(100, lambda arm: arm.clock, workspace)
    stack.tool_speed.limit = REDUCED_SPEED
    names, zero = tuple(axis.name for axis in stack.hardware.axes), (0.0,) * 4
    goal = Goal(JointTrajectory(names, (Point(8.0, _START, zero, zero),)), collision_checked=True)
    stack.trajectory.send_goal(goal, clock.now())
    for _ in range(1500):
        stack.loop.step()
    proven, bare = _proven(stack)
    values = {"joints": names, "interface_name": "position"}
    stack.manager.load("stream", ForwardCommandController.TYPE, values)
    stack.manager.configure("stream")
    stack.manager.switch(clock.now(), ("stream",), (TRAJECTORY,))
    free = _streamed(stack, _TO_AND_FRO)
    stack.use_workspace(workspace.with_scene(Scene(_ZONES, 0.0)))
    stack.tool_speed.limit = REDUCED_SPEED
    interventions = stack.collision_guard.interventions
    near = _streamed(stack, _INTO)
    braked = stack.collision_guard.interventions - interventions
    return [
        at_most(
            "keeping clear, a collision-checked trajectory", proven, _PROVEN, bare, "a bare cycle"
        ),
        _row("in the free", free, _FREE, "nothing but the arm itself"),
        _row(
            "into one of six zones and back",
            near,
            _NEAR,
            f"braked in {braked} of {CYCLES} cycles",
        ),
        _sampled(workspace),
    ]


def _row(what: str, measured: tuple[list[float], float], most: float, note: str) -> Row:
    costs, bare = measured
    median, p99 = costs[len(costs) // 2], costs[len(costs) * 99 // 100]
    what = f"keeping clear, a raw stream at 100 Hz {what}, median"
    return at_most(what, median, most, bare, "a bare cycle", f"{duration(p99)} p99; {note}")
