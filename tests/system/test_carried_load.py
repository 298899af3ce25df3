"""The fastest point of a carried load keeps to the reduced speed, in every kind of motion.

The true load is that at the far ends of the belts of the simulated arm; each of its corners is
judged as the point of a tool of its own.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import pytest

from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.kinematics import Joints, Pose, Scara, batch
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity
from bioscara.robot.connection.stack import HOLD
from bioscara.robot.planner import Plan
from bioscara.robot.workspace.load import Load
from system.loads import KINEMATICS, NAMES, Loads
from system.test_load_speed import (
    HIGHEST,
    jogged,
    near,
    note,
    place,
    planned,
    some_velocity,
    starts,
)

TRAY = Load("tray", Prism.between((-0.05, -0.043, -0.01), (0.16, 0.043, 0.01), 0.2), 0.2)
"""Its corners are up to 0.17 m from the point of the tool."""


@pytest.fixture(scope="module")
def laden(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Loads]:
    with Loads(tmp_path_factory.mktemp("evidence")) as made:
        made.robot.unfold()
        made.robot.attach(TRAY)
        yield made


def corners() -> Iterator[Scara]:
    """Yield the arm with the point of its tool at each corner of the load."""
    shape = TRAY.shape_in_wrist(KINEMATICS.tool)
    for x, y in shape.corners():
        yield Scara(KINEMATICS.geometry, KINEMATICS.limits, Pose(x, y, shape.low))


def assert_slow(laden: Loads, motion: Callable[[], object]) -> float:
    """Require that all corners keep to the limit; return the speed of the fastest [m/s]."""
    seen = laden.watch(motion)
    speeds = [batch.tool_speeds(corner, seen[:, 1:5], seen[:, 5:]) for corner in corners()]
    fastest = float(np.max(speeds))
    note(f"{1e3 * fastest:.1f} mm/s")
    assert fastest < HIGHEST, f"{1e3 * fastest:.1f} mm/s at a corner"
    return fastest


def test_a_load_that_only_turns_is_slowed_down(laden: Loads) -> None:
    robot = laden.robot
    robot.move_joints((0.3, 0.2, 0.6, -1.5))
    turn = robot.plan.move_joints((0.3, 0.2, 0.6, 1.5))
    assert assert_slow(laden, lambda: robot.execute(turn)) > 0.1
    for velocity in (JointVelocity(j4=-5.0), ToolVelocity(yaw=5.0)):
        assert assert_slow(laden, partial(jogged, laden, [(velocity, 0.8)])) > 0.08


@pytest.mark.parametrize("kind", ["joints", "lines"])
def test_planned_motions(laden: Loads, kind: str) -> None:
    robot = laden.robot
    # The second motion of the joints makes the wrist swing; the first does not.
    for rng in starts(laden, f"laden {kind}", first=1 if kind == "joints" else 0):

        def make(here: Pose, rng: random.Random = rng) -> Plan:
            if kind == "lines":
                return robot.plan.move_linear(near(rng, here, 0.2))
            return robot.plan.move_joints(place(rng))

        plan = planned(laden, make)
        cap = robot.runner.arm.stack.tool_speed
        before = cap.interventions
        assert_slow(laden, partial(robot.execute, plan))
        assert cap.interventions == before, "slowed down although it was planned within the limit"


def test_jogs(laden: Loads) -> None:
    for rng in starts(laden, "laden jogs"):
        parts = [(some_velocity(rng), rng.uniform(0.05, 0.8)) for _ in range(8)]
        assert_slow(laden, partial(jogged, laden, parts))


@pytest.mark.parametrize("interface", ["position", "velocity"])
def test_raw_streams(laden: Loads, interface: str) -> None:
    robot, stack = laden.robot, laden.robot.runner.arm.stack
    name = f"raw {interface}"
    values = {"joints": NAMES, "interface_name": interface}
    stream = stack.manager.load(name, ForwardCommandController.TYPE, values)
    stack.manager.configure(name)
    assert isinstance(stream, ForwardCommandController)
    for rng in starts(laden, name):
        robot.enable()
        stack.cycle()
        stack.use(name, robot.clock.now())
        here = robot.plan.here()

        def go(rng: random.Random = rng, here: Joints = here) -> None:
            for cycle in range(200):
                if cycle % 40 == 0:
                    most = (0.3, 0.03, 0.5, 1.5) if interface == "position" else (0.5, 0.02, 1, 5)
                    wanted = [rng.uniform(-high, high) for high in most]
                    if interface == "position":
                        wanted = [a + b for a, b in zip(here, wanted, strict=True)]
                        wanted[1] = min(max(wanted[1], 0.02), 0.32)
                    stream.command(wanted)
                stack.loop.step()
            stack.use(HOLD, robot.clock.now())
            for _ in range(60):
                stack.loop.step()
            assert not stack.supervisor.faults

        assert_slow(laden, go)
