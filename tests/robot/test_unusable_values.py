"""Every call of the robot, its planner and their values, with values that no call can use."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bioscara import Robot
from bioscara.robot.planner import Planner
from bioscara.robot.robot_gripper import RobotGripper
from bioscara.robot.workspace.poses import TeachTable
from robot_calls import HALF, NAMES, calls
from simulated import simulated_robot
from unusable_values import judge


class World:
    """A robot that stands at ``HALF``, and the conditions that must hold after each call."""

    def __init__(self, folder: Path) -> None:
        self.robot: Any
        self.arm, _, self.robot = simulated_robot(folder, seed=4, homed=True, at=HALF)
        self._before: list[float] = []

    def where(self) -> list[float]:
        return [self.arm.position(name) for name in NAMES]

    def look(self) -> None:
        self._before = self.where()

    def after(self, refused: bool) -> str:
        before, now = self._before, self.where()
        self._before = now
        robot = self.robot
        for operation in robot.runner.arm.operations:
            operation.cancel()
            operation.wait(30.0)
        robot.speed_override = 1.0
        if robot.load is not None:
            robot.detach()
        if robot.faults:
            return f"a fault is latched: {robot.faults[0]}"
        if refused and max(abs(a - b) for a, b in zip(before, now, strict=True)) > 1e-3:
            return f"the arm moved from {before} to {now}"
        return ""


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    made = World(tmp_path_factory.mktemp("evidence"))
    with made.robot:
        made.robot.move_joints(HALF)
        yield made


def test_every_call_takes_a_value_or_refuses_it_and_the_arm_stays_usable(world: World) -> None:
    complaints = []
    for name, (call, base) in calls(world.robot).items():
        world.look()
        complaints += judge(name, call, base, world.after)
        world.robot.reduced_speed = True
        world.robot.move_joints(HALF)
    assert complaints == [], "\n" + "\n".join(complaints)


def test_every_public_call_is_in_the_table(world: World) -> None:
    table = calls(world.robot)
    missing = []
    for kind in (Robot, Planner, RobotGripper, TeachTable):
        for name, member in inspect.getmembers(kind):
            if name.startswith("_"):
                continue
            if isinstance(member, property):
                wanted = {"value"} if member.fset else set()
            elif callable(member):
                wanted = set(inspect.signature(member).parameters) - {"self"}
            else:
                continue
            called = table.get(f"{kind.__name__}.{name}")
            missing += [
                f"{kind.__name__}.{name}({parameter})"
                for parameter in wanted
                if called is None or parameter not in called[1]
            ]
    assert missing == []
