"""Plates that are gripped, carried, stacked, missed and dropped; the plant is judged."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bioscara import Pose, Robot
from bioscara.physics import arm_model, servo_force
from physics.worlds import (
    FLOOR,
    LOAD,
    MASS,
    PLATE,
    A,
    B,
    held_at,
    offset,
    pick,
    put,
    simulated,
    stack,
    transfer_world,
)  # fmt: skip

GRAVITY = 9.81


@pytest.mark.parametrize(
    ("mass", "times"), [(0.04, 1), pytest.param(0.06, 5, marks=pytest.mark.thorough)]
)
def test_a_plate_is_carried_within_half_a_millimetre(mass: float, times: int) -> None:
    with simulated(transfer_world(*stack("plate", mass=mass))) as robot:
        robot.enable()
        robot.gripper.open()
        pick(robot, A)
        assert robot.simulation.held == "plate"
        assert robot.simulation.width == pytest.approx(PLATE.size[1], abs=1e-3)
        before = in_hand(robot)
        above = held_at(B).up(0.08)
        for _ in range(times):
            robot.move_to(above)
            robot.move_to(held_at(A).up(0.08))
        moved = np.abs(in_hand(robot) - before)
        assert moved.max() < 5e-4, moved
        rested = in_hand(robot)
        robot.clock.sleep_until(robot.clock.now() + 5.0)
        assert np.abs(in_hand(robot) - rested).max() < 1e-6
        weight = -robot.simulation._world.data.qfrc_constraint[1]
        assert weight == pytest.approx(mass * GRAVITY, rel=0.01)


def in_hand(robot: Robot) -> np.ndarray:
    """Return where the plate is as seen from the true tool [m], shape (3,)."""
    arm, pose = robot.bus.arm, robot.simulation.pose("plate")  # type: ignore[attr-defined]
    tool = robot.kinematics.forward([arm.position(f"j{i}") for i in range(1, 5)])
    cos, sin = math.cos(tool.yaw), math.sin(tool.yaw)
    x, y, z = pose.x - tool.x, pose.y - tool.y, pose.z - tool.z
    return np.array([cos * x + sin * y, cos * y - sin * x, z])


def test_a_plate_is_placed_in_the_other_nest() -> None:
    with simulated(transfer_world(*stack("plate"))) as robot:
        robot.enable()
        robot.gripper.open()
        pick(robot, A)
        put(robot, B)
        assert robot.simulation.held is None
        distance, turn = offset(robot, "plate", B)
        assert distance < 1e-3
        assert turn < 5e-3


@pytest.mark.thorough
def test_a_stack_of_four_is_moved_plate_by_plate() -> None:
    with simulated(transfer_world(*stack("p0", "p1", "p2", "p3"))) as robot:
        robot.enable()
        robot.gripper.open()
        for moved in range(4):
            pick(robot, A, 3 - moved)
            assert robot.simulation.held == f"p{3 - moved}"
            put(robot, B, moved)
        for level in range(4):
            distance, turn = offset(robot, f"p{3 - level}", B, level)
            assert distance < 1e-3 * (1 + level)
            assert turn < 5e-3


def test_a_plate_falls_when_the_pulses_end() -> None:
    with simulated(transfer_world(*stack("plate"))) as robot:
        robot.enable()
        robot.gripper.open()
        pick(robot, A)
        height = robot.simulation.pose("plate").z
        robot.gripper.disable()
        robot.clock.sleep_until(robot.clock.now() + 0.5)
        assert robot.simulation.held is None
        assert robot.simulation.pose("plate").z < height - 0.07


@pytest.mark.parametrize(("share", "falls"), [(0.8, True), (1.25, False)])
def test_a_plate_is_held_by_friction(
    share: float, falls: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Its weight is what friction of both pads can hold, or a share of that; the jaws' own friction
    # takes a part of the servo's force.
    needed = MASS * GRAVITY / (2.0 * arm_model.PAD_FRICTION[0]) + arm_model.JAW_FRICTION
    torque = share * needed / math.radians(3333.3)
    monkeypatch.setattr(servo_force, "TORQUE", torque)
    with simulated(transfer_world(*stack("plate"))) as robot:
        robot.enable()
        robot.gripper.open()
        pick(robot, A, up=0.05)
        lifted = robot.simulation.pose("plate").z > FLOOR + 0.03
        assert lifted is not falls


def test_jaws_that_miss_hold_nothing() -> None:
    with simulated(transfer_world(*stack("plate"))) as robot:
        robot.enable()
        robot.gripper.open()
        place = held_at(A)
        above = Pose(place.x, place.y, place.z + 0.05, place.yaw)
        robot.move_to(above)
        robot.gripper.grasp(LOAD)
        assert robot.simulation.held is None
        assert robot.simulation.width == pytest.approx(robot.gripper.width, abs=2e-4)
