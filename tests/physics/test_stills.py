"""Images of a world that goes on: each is of one time, also if bodies move until it is drawn."""

from __future__ import annotations

import pickle
from collections.abc import Iterator

import numpy as np
import pytest

from bioscara import Robot
from bioscara.errors import InvalidArgumentError, NotSupportedError
from bioscara.physics.camera import render
from bioscara.physics.stills import image_of, still_of
from bioscara.robot.simulation import world_of
from physics.worlds import A, B, held_at, simulated, stack, transfer_world
from ros_environment import absent

SMALL = (160, 120)


@pytest.fixture
def robot() -> Iterator[Robot]:
    with simulated(transfer_world(*stack("plate"))) as robot:
        try:
            robot.simulation.image(size=SMALL)
        except NotSupportedError as error:
            absent(f"the tests of images: {error}")
        yield robot


def rest(robot: Robot, time: float = 0.5) -> None:
    robot.clock.sleep_until(robot.clock.now() + time)


def turned(robot: Robot) -> tuple[float, ...]:
    """Return positions from where the column is turned."""
    first, *others = robot.state.positions
    return (first + 0.5, *others)


def test_an_image_is_that_of_the_engine_and_of_all_bodies_now(robot: Robot) -> None:
    seen = [robot.simulation.image("front", SMALL)]
    assert (seen[0].shape, seen[0].dtype) == ((120, 160, 3), np.uint8)
    # The background is light.
    assert seen[0].min(axis=2)[0].min() > 150
    robot.simulation.add_obstacle("box", (0.3, -0.05, 0.0), (0.4, 0.05, 0.3))
    seen.append(robot.simulation.image("front", SMALL))
    robot.simulation.tilt("a", 0.02)
    rest(robot)
    seen.append(robot.simulation.image("front", SMALL))
    robot.simulation.take_away("plate")
    seen.append(robot.simulation.image("front", SMALL))
    robot.enable()
    robot.move_joints(turned(robot))
    seen.append(robot.simulation.image("front", SMALL))
    world = world_of(robot.runner.arm)
    assert (render(world.model, world.data, "front", SMALL) == seen[-1]).mean() > 0.999
    for number, image in enumerate(seen[1:]):
        assert (np.abs(image.astype(int) - seen[number]).max(axis=2) > 20).sum() > 10, number


def test_a_still_keeps_its_time_while_the_world_goes_on(robot: Robot) -> None:
    world = world_of(robot.runner.arm)
    still = still_of(world)
    before = image_of(still, "front", SMALL)
    robot.simulation.tilt("a", 0.02)
    rest(robot)
    robot.simulation.push("plate", (0.0, 5.0, 5.0))
    robot.simulation.take_away("b")
    rest(robot)
    assert (image_of(still_of(world), "front", SMALL) != before).any()
    assert (image_of(still, "front", SMALL) == before).all()
    # As it goes to another process.
    assert (image_of(pickle.loads(pickle.dumps(still)), "front", SMALL) == before).all()


def test_images_while_the_arm_moves_follow_the_gripper(robot: Robot) -> None:
    robot.enable()
    robot.gripper.open()
    motion = robot.move_joints(turned(robot), wait=False)
    wrist: list[np.ndarray] = []
    front: list[np.ndarray] = []
    while not motion.done or not wrist:
        wrist.append(robot.simulation.image("wrist", SMALL))
        front.append(robot.simulation.image("front", SMALL))
    motion.result()
    front.append(robot.simulation.image("front", SMALL))
    assert (front[0] != front[-1]).any()
    # The jaws stay where they are in the images of the camera on the gripper: dark, at both sides.
    for image in wrist:
        dark = image.max(axis=2) < 90
        assert dark[60:90, :80].sum() > 200
        assert dark[60:90, 80:].sum() > 200


def test_the_camera_of_the_gripper_sees_the_plate_between_the_jaws(robot: Robot) -> None:
    robot.enable()
    robot.gripper.open()
    robot.move_to(held_at(A).up(0.05))
    image = robot.simulation.image("wrist", SMALL).astype(int)
    blue = image[..., 2] - image[..., 0] > 60
    rows, columns = np.nonzero(blue)
    assert blue.sum() > 1000
    assert (columns.mean(), rows.mean()) == pytest.approx((79.5, 65.0), abs=12.0)
    robot.move_to(held_at(B).up(0.05))
    image = robot.simulation.image("wrist", SMALL).astype(int)
    assert (image[..., 2] - image[..., 0] > 60).sum() < 50


def test_what_cannot_be_shown_is_refused(robot: Robot) -> None:
    with pytest.raises(InvalidArgumentError, match="did you mean wrist"):
        robot.simulation.image("wirst")
    with pytest.raises(InvalidArgumentError, match="image size"):
        robot.simulation.image("wrist", (1, 1))
    with Robot.simulated() as bare, pytest.raises(NotSupportedError, match="world="):
        bare.simulation.image()
