"""Make the pictures of the demonstration's world: ``python -m tools.physics_pictures [FOLDER]``.

Needs the extra ``physics-view``. The arm lifts the plate out of its nest, and each camera takes it
there. The pictures land in ``docs/images``, or in the folder, as ``physics-CAMERA.png``.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from bioscara import Load, Robot
from bioscara.cli.runs.carry import demo_world

IMAGES = Path(__file__).parents[1] / "docs/images"
CAMERAS = ("front", "wrist")
SIZE = (960, 720)


def make(robot: Robot, folder: Path) -> None:
    """Write a picture of a simulated robot's world for each camera."""
    for camera in CAMERAS:
        picture = Image.fromarray(robot.simulation.image(camera, SIZE))
        picture.quantize(128).save(folder / f"physics-{camera}.png", optimize=True)


def main(words: Sequence[str]) -> None:
    """Lift the plate, and make the pictures."""
    world = demo_world()
    plate = world.item("plate")
    place = plate.grip.pose
    load = Load("plate", plate.shape_in_tool, plate.mass, ("a",))
    with Robot.simulated(world=world, homed=True) as robot:
        robot.enable()
        robot.gripper.open()
        robot.move_to(place.up(0.04))
        robot.move_linear(place)
        robot.scene = world.without("plate").planned
        robot.gripper.grasp(load)
        robot.move_linear(place.up(0.06))
        make(robot, Path(*words) if words else IMAGES)


if __name__ == "__main__":
    main(sys.argv[1:])
