"""Every call of a robot that another process owns, with values that no call can use."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from bioscara import Robot
from bioscara.server.serve import Served
from robot_calls import calls
from served import HALF, NAME, arm_served
from simulated import NAMES
from unusable_values import SHARE, judge

OF_THE_OWNER = ("Robot.", "RobotGripper.", "jog(", "attach(", "Box", "Cylinder", "Scene")
"""Begin of the names of those calls that reach the owner."""
EACH_WAY = (
    "Robot.home", "Robot.do", "Robot.follow", "Robot.execute", "Robot.move_linear", "Robot.jog",
    "jog(", "Robot.states", "Robot.speed_override", "Robot.scene", "Robot.table",
    "RobotGripper.grasp",
)  # fmt: skip
"""Those that each go another way; of the others ``make laws`` tries all."""
OF_HOW_MANY = 1 if SHARE == 1 else 10
"""Of how many values one is tried: they are checked as those of a robot in this process are."""
ELSEWHERE = {"Robot.watch", "Robot.simulated", "Robot.connect", "Robot.on_bus", "Scara.solve"}


class World:
    """A client of a served arm, and the conditions that must hold after each call."""

    def __init__(self, robot: Any, served: Served) -> None:
        self.robot, self.served = robot, served
        self._before: list[float] = []

    def where(self) -> list[float]:
        bus: Any = self.served.robot.bus
        return [bus.arm.position(name) for name in NAMES]

    def look(self) -> None:
        self._before = self.where()

    def after(self, refused: bool) -> str:
        own: Any = self.served.robot
        for operation in own.runner.arm.operations:
            operation.cancel()
            operation.wait(30.0)
        before, now = self._before, self.where()
        self._before = now
        own.speed_override = 1.0
        if own.load is not None:
            self.robot.detach()
        if own.faults:
            return f"a fault is latched: {own.faults[0]}"
        # A short timeout ends a motion that has begun; the arm brakes in the time that this takes.
        if refused and max(abs(a - b) for a, b in zip(before, now, strict=True)) > 2e-2:
            return f"the arm moved from {before} to {now}"
        return ""


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    with arm_served(speed=1000.0) as served, Robot.connect(f"arm:{NAME}") as robot:
        yield World(robot, served)


def names() -> list[str]:
    with arm_served() as served:
        found = calls(served.robot)
    begins = OF_THE_OWNER if SHARE == 1 else EACH_WAY
    return [name for name in found if name.startswith(begins) and name not in ELSEWHERE]


@pytest.mark.parametrize("name", names())
def test_a_call_takes_a_value_or_refuses_it_and_the_arm_stays_usable(
    world: World, name: str
) -> None:
    call, base = calls(world.robot)[name]
    world.look()
    complaints = judge(name, call, base, world.after, share=OF_HOW_MANY)
    world.robot.reduced_speed = True
    world.robot.move_joints(HALF)
    assert complaints == [], "\n" + "\n".join(complaints)
