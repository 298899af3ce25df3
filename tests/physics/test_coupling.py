"""Joints in a world: the same bits where nothing touches, stalls where something does."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from bioscara import Robot
from bioscara.errors import StalledError
from bioscara.model import load_parameters
from bioscara.physics.world import PhysicsWorld
from bioscara.planning.world import Item, Nest, World
from bioscara.sim import SimulatedArm, SimulatedServo
from bioscara.sim.simulated_arm import JOINTS
from physics.worlds import TABLE, Watched, simulated, stack, transfer_world
from programs import LIMIT, environment

START = [0.0, 0.2, 0.0, 0.0]


def trace(robot: Robot) -> bytes:
    """Return the bits of a motion, of the joints' true state in each cycle."""
    rows: list[float] = []
    with robot:
        robot.enable()
        arm = robot.bus.arm  # type: ignore[attr-defined]

        def see(_: object) -> None:
            rows.extend(f(joint) for f in (arm.position, arm.velocity) for joint in JOINTS)

        robot.move_joints(START, on_cycle=see)
        robot.move_joints([0.5, 0.25, 0.4, 1.0], on_cycle=see)
    return np.array(rows).tobytes()


def test_an_arm_that_touches_nothing_moves_with_the_same_bits() -> None:
    world = transfer_world(*stack("plate", "second"))
    alone = Robot.simulated(seed=1, homed=True)
    assert trace(simulated(world)) == trace(alone)


@pytest.mark.parametrize(
    ("goal", "lower", "upper", "scaling"),
    [
        ([1.0, 0.2, 0.0, 0.0], (0.55, 0.45, 0.0), (0.75, 0.47, 0.6), 0.25),
        ([0.0, 0.2, 1.0, 0.0], (0.38, 0.20, 0.0), (0.65, 0.22, 0.6), 0.05),
        ([0.0, 0.2, 0.0, 1.0], (0.45, 0.12, 0.0), (0.90, 0.14, 0.6), 0.025),
    ],
    ids=["j1", "j3", "j4"],
)
def test_a_wall_stalls_the_arm_which_recovers(
    goal: list[float],
    lower: tuple[float, float, float],
    upper: tuple[float, float, float],
    scaling: float,
) -> None:
    deepest, fastest, since = 0.0, 0.0, 0

    def look(world: PhysicsWorld) -> None:
        nonlocal deepest, fastest, since
        data = world.data
        if data.ncon:
            deepest = min(deepest, data.contact.dist.min())
        if since or world.data.qfrc_constraint[:4].any():
            since += 1
        if since > 50:
            fastest = max(fastest, np.abs(data.qvel[[0, 2, 3]]).max())

    with simulated(World(table=TABLE)) as robot:
        robot.enable()
        robot.move_joints(START)
        robot.simulation.add_obstacle("wall", lower, upper)
        Watched(robot.simulation._world, look)
        with pytest.raises(StalledError):
            robot.move_joints(goal, velocity_scaling=scaling)
        assert since > 50
        assert deepest > -1e-3
        assert fastest < 0.52
        robot.acknowledge()
        robot.recover()
        robot.enable()
        robot.move_joints(START)


def test_plates_below_stall_the_lift() -> None:
    below = Nest(name="below", x=0.73, y=0.0, z=0.01)
    world = World(table=TABLE, nests=(below,), items=stack("lower", "upper", nest=below))
    with simulated(world) as robot:
        robot.enable()
        robot.move_joints(START)
        robot.scene = type(robot.scene)()
        with pytest.raises(StalledError, match="j2"):
            robot.move_joints([0.0, 0.0, 0.0, 0.0])
        robot.acknowledge()
        robot.recover()
        robot.enable()
        robot.move_joints(START)


def around(arm: SimulatedArm, *items: Item) -> PhysicsWorld:
    """Surround an arm that has no host by two nests and items."""
    parameters = load_parameters()
    servo = SimulatedServo(parameters.gripper.outputs[0])
    return PhysicsWorld(arm, servo, transfer_world(*items), parameters)


PROGRAM = """
from physics.worlds import *

with simulated(transfer_world(*stack("plate"))) as robot:
    robot.enable()
    robot.gripper.open()
    pick(robot, A)
    world = robot.simulation._world
    print(world.data.qpos.tobytes().hex(), robot.clock.now())
    print(world._coupling.contact.tobytes().hex())
"""


@pytest.mark.thorough
def test_two_processes_compute_the_same_bits() -> None:
    words = [sys.executable, "-c", PROGRAM]
    started = [
        subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment())
        for _ in range(2)
    ]
    first, second = (process.communicate(timeout=LIMIT)[0] for process in started)
    assert first == second
    assert len(first) > 100


def test_a_restored_state_goes_on_with_the_same_bits() -> None:
    arm = SimulatedArm(seed=2)
    world = around(arm, *stack("plate", "second"))
    arm.run(0.5)
    world.push("second", (1.0, 0.5, 0.0), 0.2)
    arm.push("j1", 3.0)
    arm.run(0.1)
    saved, ends = world.save(), []
    for _ in range(2):
        world.restore(saved)
        arm.run(1.0)
        joints = [arm.position(joint) for joint in JOINTS]
        ends.append((world.data.qpos.tobytes(), world.data.qvel.tobytes(), joints))
    assert ends[0] == ends[1]


def test_steps_of_any_length_give_the_same_bits() -> None:
    ends = []
    for step in (0.01, 0.1):
        arm = SimulatedArm(seed=2)
        world = around(arm, *stack("plate"))
        world.push("plate", (2.0, 1.0, 0.0), 0.2)
        for _ in range(round(1.0 / step)):
            arm.run(step)
        ends.append(world.data.qpos.tobytes())
    assert ends[0] == ends[1]


def test_an_error_of_the_world_is_raised_once_and_the_arm_goes_on() -> None:
    arm = SimulatedArm(seed=2)
    (position, velocity, drive, contact), begun = np.zeros((4, 4)), arm.now()

    def fail() -> None:
        raise ValueError("bodies")

    arm.set_world(position, velocity, drive, contact, fail)
    with pytest.raises(ValueError, match="bodies"):
        arm.run(0.5)
    arm.run(0.5)
    assert arm.now() == pytest.approx(begun + 1.0)
