"""Keeping the arm clear of its surroundings: cost of the last stages in each cycle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from time import perf_counter

from benchmarks.control import homed_stack
from benchmarks.measure import Row
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.controllers.joint_trajectory import Goal, JointTrajectory, Point
from bioscara.control.limits.limiter import CommandSource
from bioscara.kinematics import Scara
from bioscara.model import load_parameters
from bioscara.planning.collision.scene import Box, Scene
from bioscara.planning.limits import REDUCED_SPEED
from bioscara.robot import kinematics_of
from bioscara.robot.connection.stack import TRAJECTORY, Stack

CYCLES = 3000
_CALLS = 200_000
_PROVEN, _FREE, _NEAR = 1e-6, 100e-6, 2e-3
_START = (0.3, 0.2, 0.8, -0.5)
_ZONES = tuple(
    Box(f"zone_{i}", (-0.5 + 0.2 * i, 0.66, 0.0), (-0.35 + 0.2 * i, 0.9, 0.4)) for i in range(6)
)
_TO_AND_FRO, _INTO = (0.4, 0.02, 0.4, 0.8), (0.6, 0.02, 0.2, 0.4)


def _proven(stack: Stack) -> float:
    """Return the cost of the stage in a cycle that follows a collision-checked trajectory [s]."""
    stage = stack.collision_guard
    best = math.inf
    for _ in range(5):
        begin = perf_counter()
        for _ in range(_CALLS // 5):
            stage.prepare(0.01, ())
            stage.apply(0.01, ())
        best = min(best, (perf_counter() - begin) / (_CALLS // 5))
    return best


def _streamed(stack: Stack, swing: Sequence[float]) -> list[float]:
    """Return the sorted cycle costs [s] of a stream that swings to and fro, averaging included."""
    forward = stack.manager.controller("stream")
    if not isinstance(forward, ForwardCommandController):
        raise TypeError(type(forward).__name__)
    guard, smoothing, costs = stack.collision_guard, stack.smoothing, []
    begin = 0.0

    class Timed:
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
    limiter.stages = before
    if stack.supervisor.faults:
        raise RuntimeError(str(stack.supervisor.faults[0]))
    return sorted(costs)


def rows() -> list[Row]:
    """Measure a collision-checked trajectory, and a raw stream in free space and next to zones."""
    surroundings: list[tuple[Scara, Scene]] = [(kinematics_of(load_parameters()), Scene())]
    stack, clock = homed_stack(100, lambda arm: arm.clock, lambda: surroundings[-1])
    stack.tool_speed.limit = REDUCED_SPEED
    stack.smoothing.windows = load_parameters().belt_periods[:2]
    names, zero = tuple(axis.name for axis in stack.arm.axes), (0.0,) * 4
    goal = Goal(JointTrajectory(names, (Point(8.0, _START, zero, zero),)), collision_checked=True)
    stack.trajectory.send_goal(goal, clock.now())
    for _ in range(1500):
        stack.loop.step()
    proven = _proven(stack)
    values = {"joints": names, "interface_name": "position"}
    stack.manager.load("stream", ForwardCommandController.TYPE, values)
    stack.manager.configure("stream")
    stack.manager.switch(clock.now(), ("stream",), (TRAJECTORY,))
    free = _streamed(stack, _TO_AND_FRO)
    surroundings.append((surroundings[0][0], Scene(_ZONES, 0.0)))
    interventions = stack.collision_guard.interventions
    near = _streamed(stack, _INTO)
    braked = stack.collision_guard.interventions - interventions
    return [
        Row(
            "keeping clear, a trajectory that was swept",
            f"{1e6 * proven:.2f} us a cycle",
            "it is not looked at",
            "at most 1 us",
            proven <= _PROVEN,
        ),
        _row("in the free", free, "nothing but the arm itself", "at most 100 us median", _FREE),
        _row(
            "into one of six zones and back",
            near,
            f"braked in {braked} of {CYCLES} cycles",
            "at most 2 ms median",
            _NEAR,
        ),
    ]


def _row(what: str, costs: Sequence[float], reference: str, limit: str, most: float) -> Row:
    median, p99 = costs[len(costs) // 2], costs[len(costs) * 99 // 100]
    return Row(
        f"keeping clear, a raw stream at 100 Hz {what}",
        f"{1e6 * median:.0f} us median, {1e6 * p99:.0f} us p99",
        reference,
        limit,
        median <= most,
    )
