"""Planned moves end in time: when the plan ends, the motors stand at their goals."""

from __future__ import annotations

import random
from functools import partial
from pathlib import Path

import numpy as np

from bioscara import Robot
from bioscara.errors import BioscaraError
from bioscara.kinematics import Joints
from bioscara.robot.planner import Plan
from system.loads import NAMES, Loads

MOVES = 12
MICROSTEPS = 4.0
DELAY = 0.02
"""A setpoint is sent one cycle after its time, and reached one cycle later [s]."""
SWING = 0.5
"""Time in which a swing of a load would be seen, or a correction that comes late [s]."""


def move(robot: Robot, plan: Plan) -> None:
    robot.execute(plan)
    robot.clock.sleep_until(robot.clock.now() + SWING)


def test_when_a_plan_ends_every_motor_stands_within_4_microsteps(tmp_path: Path) -> None:
    rng = random.Random("arrival")
    with Loads(tmp_path) as loads:
        moves = 0
        while moves < MOVES:
            elbow = rng.uniform(0.2, 1.8) * rng.choice((-1.0, 1.0))
            goal = Joints(rng.uniform(-2.0, 2.0), rng.uniform(0.1, 0.3), elbow, rng.uniform(-1, 1))
            try:
                plan = loads.robot.plan.move_joints(goal)
            except BioscaraError:
                continue
            moves += 1
            ends = loads.arm.now() + plan.trajectory.duration + DELAY
            rotors = loads.watch_rotors(partial(move, loads.robot, plan))
            after = rotors[rotors[:, 0] >= ends][:, 1:]
            off = np.abs(after - rotors[-1, 1:]).max(axis=0)
            assert (off <= MICROSTEPS).all(), (moves, goal, dict(zip(NAMES, off, strict=True)))
