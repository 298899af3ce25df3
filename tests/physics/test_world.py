"""Bodies of a world: the planner's shapes, disturbances, and refusals."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bioscara import Box, Robot, Scene
from bioscara.errors import (
    BioscaraError,
    BusyError,
    ConfigurationError,
    InvalidArgumentError,
    LifecycleError,
    LimitError,
    NotSupportedError,
)
from bioscara.model import load_parameters
from bioscara.physics.arm_model import LEFT, RIGHT
from bioscara.physics.engine import mujoco
from bioscara.physics.world import PhysicsWorld
from bioscara.planning.world import Item, Wall, World
from bioscara.robot.simulation import Simulation
from bioscara.robot.workspace.workspace import Workspace
from bioscara.sim import SimulatedArm, SimulatedServo
from physics.worlds import FLOOR, PLATE, TABLE, A, pick, simulated, stack, transfer_world

ARM = load_parameters()
WALLS = (
    Wall(name="front", lower=(-0.1, 0.3, 0.0), upper=(0.1, 0.35, 0.3), yaw=0.4),
    Wall(name="back", lower=(-0.5, -0.4, 0.0), upper=(-0.2, -0.3, 0.15)),
    Wall(name="shelf", lower=(0.2, -0.5, 0.1), upper=(0.6, -0.2, 0.2)),
)


def around(world: World) -> tuple[SimulatedArm, PhysicsWorld]:
    """Return an arm without a host, and the world around it."""
    arm = SimulatedArm(seed=0)
    return arm, PhysicsWorld(arm, SimulatedServo(ARM.gripper.outputs[0]), world, ARM)


def test_poses_that_the_planner_calls_clear_touch_nothing() -> None:
    # Both directions, as the walls have the same shape for both: of the planner's bodies, the
    # tool's point alone has none.
    _, world = around(World(table=TABLE, walls=WALLS))
    workspace, rng = Workspace.of(ARM), np.random.default_rng(46)
    scene = Scene(
        tuple(Box(wall.name, wall.lower, wall.upper, wall.yaw) for wall in WALLS), TABLE.height
    )
    lower, upper = np.array([(joint.lower, joint.upper) for joint in ARM.joints]).T
    touching, engine, data = 0, mujoco(), world.data
    for joints in rng.uniform(lower, upper, (1000, 4)):
        width = rng.uniform(ARM.gripper.lower, ARM.gripper.upper)
        layout = replace(scene, widths=(width, width)).layout(workspace.kinematics)
        bodies = np.array([pair.link != "tool" for pair in layout.pairs])
        allowed = np.array([pair.allowed for pair in layout.pairs])
        distances = layout.clearances(workspace.kinematics, joints[None])[:, 0] - allowed
        clear = float(distances[bodies].min())
        data.qpos[:4] = joints
        data.joint(LEFT).qpos[0] = data.joint(RIGHT).qpos[0] = width / 2.0
        engine.mj_forward(world.model, data)
        contact = data.ncon > 0 and float(data.contact.dist.min()) < 0.0
        if abs(clear) > 1e-6:
            assert contact is (clear < 0.0), (joints.tolist(), width, clear)
        touching += contact
    assert touching > 100


def test_bodies_are_where_the_world_has_them() -> None:
    arm, world = around(transfer_world(*stack("lower", "upper")))
    arm.run(1.0)
    poses = {pose.name: pose for pose in world.poses()}
    assert [shape.name for shape in world.shapes] == list(poses)
    for name, height in (("lower", FLOOR), ("upper", FLOOR + PLATE.stack_height)):
        place = np.array(poses[name][1:4]) - (A.x, A.y, height)
        assert np.abs(place).max() < 1e-4, place


def test_bodies_are_pushed_tilted_and_taken_away() -> None:
    arm, world = around(transfer_world(*stack("lower", "upper")))

    def height(name: str) -> float:
        return next(pose.z for pose in world.poses() if pose.name == name)

    world.tilt("a", 2e-3, math.pi / 2.0)
    arm.run(1.0)
    pose = next(pose for pose in world.poses() if pose.name == "upper")
    assert 2.0 * math.asin(abs(pose.qx)) == pytest.approx(2e-3 / PLATE.size[0], rel=0.1)
    world.add_obstacle("box", (0.5, 0.5, 0.0), (0.6, 0.6, 0.1))
    arm.run(0.1)
    nest = next(pose for pose in world.poses() if pose.name == "a")
    assert 2.0 * math.asin(abs(nest.qx)) == pytest.approx(2e-3 / PLATE.size[0], rel=0.1)
    world.tilt("a", 0.0)
    arm.run(1.0)
    before = height("upper")
    world.take_away("lower")
    arm.run(0.5)
    assert height("upper") == pytest.approx(before - PLATE.stack_height, abs=1e-3)
    world.push("upper", (0.0, 1.0, 0.8), 0.15)
    arm.run(1.0)
    assert height("upper") < FLOOR, "it lies on the table"
    joint = arm.position("j1")
    world.push("link_3", (0.0, 5.0, 0.0), 0.2)
    arm.run(0.3)
    assert arm.position("j1") > joint + 1e-3


def test_a_robot_returns_to_a_saved_state_with_its_plate() -> None:
    with simulated(transfer_world(*stack("plate"))) as robot:
        robot.enable()
        robot.gripper.open()
        pick(robot, A)
        saved, time = robot.simulation.save(), robot.clock.now()
        there, pose = robot.state.positions, robot.simulation.pose("plate")
        robot.move_relative(z=0.02)
        robot.gripper.disable()
        robot.clock.sleep_until(robot.clock.now() + 0.5)
        assert robot.simulation.held is None
        robot.simulation.restore(saved)
        assert robot.simulation.held == "plate"
        assert robot.clock.now() > time
        assert robot.is_enabled
        assert np.abs(np.array(robot.state.positions) - there).max() < 1e-3
        assert math.dist(robot.simulation.pose("plate")[1:4], pose[1:4]) < 1e-3
        robot.move_relative(z=0.01)
        with pytest.raises(LifecycleError, match="no other version"):
            pickle.dumps(saved)
        with pytest.raises(InvalidArgumentError, match="no snapshot"):
            robot.simulation.restore(saved.world)  # type: ignore[arg-type]
        robot.simulate_fault("overheat", "j1", 1)
        with pytest.raises(LifecycleError, match="clear"):
            robot.simulation.save()
        robot.simulate_fault("clear")
        robot.simulation.add_obstacle("box", (0.5, 0.5, 0.0), (0.6, 0.6, 0.1))
        with pytest.raises(InvalidArgumentError, match="came or went"):
            robot.simulation.restore(saved)


def test_a_held_plate_cannot_be_taken_away_nor_a_state_be_saved_in_motion() -> None:
    with simulated(transfer_world(*stack("plate"))) as robot:
        robot.enable()
        robot.gripper.open()
        pick(robot, A)
        with pytest.raises(LifecycleError, match="release"):
            robot.simulation.take_away("plate")
        motion = robot.move_relative(z=0.02, wait=False)
        with pytest.raises(BusyError):
            robot.simulation.save()
        robot.simulation.push("plate", (0.0, 1.0, 0.0), 0.05)
        motion.result()


REFUSED: dict[str, tuple[Callable[[Simulation], object], type[BioscaraError], str]] = {
    "name": (lambda s: s.push("plat", (0, 0, 1)), InvalidArgumentError, "did you mean plate"),
    "infinite": (lambda s: s.push("plate", (0, 0, math.inf)), InvalidArgumentError, "force"),
    "two values": (lambda s: s.push("plate", (0, 1)), InvalidArgumentError, "x, y, z"),
    "strong": (lambda s: s.push("plate", (0, 0, 51)), LimitError, "force"),
    "long": (lambda s: s.push("plate", (0, 0, 1), 11), LimitError, "duration"),
    "fixed": (lambda s: s.push("a", (0, 0, 1)), InvalidArgumentError, "fixed"),
    "loose": (lambda s: s.tilt("plate", 0.001), InvalidArgumentError, "moves freely"),
    "steep": (lambda s: s.tilt("a", 0.03), LimitError, "height"),
    "in a plate": (
        lambda s: s.add_obstacle("box", (0.3, 0.2, 0.0), (0.4, 0.3, 0.1)),
        InvalidArgumentError,
        "deep in",
    ),
    "in the arm": (
        lambda s: s.add_obstacle("box", (-0.1, -0.1, 0.2), (0.1, 0.1, 0.3)),
        InvalidArgumentError,
        "the arm's link",
    ),
    "taken": (
        lambda s: s.add_obstacle("a", (0.5, 0.5, 0.0), (0.6, 0.6, 0.1)),
        InvalidArgumentError,
        "already",
    ),
    "corners": (
        lambda s: s.add_obstacle("box", (0.5, 0.5, 0.2), (0.6, 0.6, 0.1)),
        InvalidArgumentError,
        "below",
    ),
    "jaw": (lambda s: s.take_away("left jaw"), InvalidArgumentError, "no body"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_disturbances_that_cannot_be_are_refused_and_change_nothing(case: str) -> None:
    act, kind, match = REFUSED[case]
    with simulated(transfer_world(*stack("plate"))) as robot:
        before = robot.simulation.poses
        with pytest.raises(kind, match=match):
            act(robot.simulation)
        assert robot.simulation.poses == before


def test_worlds_that_cannot_be_are_refused() -> None:
    inside = Wall(name="pillar", lower=(0.4, 0.0, 0.0), upper=(0.7, 0.2, 0.2))
    with pytest.raises(ConfigurationError, match=r"pillar is .* mm deep in the arm's"):
        around(World(table=TABLE, walls=(inside,)))
    with pytest.raises(InvalidArgumentError, match="the world is 3"):
        Robot.simulated(world=3)  # type: ignore[arg-type]
    with Robot.simulated(homed=True) as robot, pytest.raises(NotSupportedError, match="world="):
        _ = robot.simulation
    assert Item.unchecked(name="p", labware=PLATE, x=0.0, y=0.0, z=0.0).mass == PLATE.mass


def test_an_engine_that_is_missing_or_old_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mujoco(), "__version__", "3.3.7")
    with pytest.raises(NotSupportedError, match=r"MuJoCo 3\.4 or newer, and 3\.3\.7.*physics"):
        around(World(table=TABLE))
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    with pytest.raises(NotSupportedError, match=r"not installed.*bioscara\[physics\]"):
        around(World(table=TABLE))
