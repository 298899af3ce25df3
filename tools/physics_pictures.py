"""Make the pictures of a world: ``python -m tools.physics_pictures [WORLD]``.

Needs the extra ``physics-view``. An arm is simulated with the world of the file, by default that of
the examples; each camera takes it as it is at the begin. The pictures land in ``docs/images``, as
``physics-CAMERA.png``; a second word is another folder for them.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from bioscara import Robot

IMAGES = Path(__file__).parents[1] / "docs/images"
WORLD = Path(__file__).parents[1] / "examples/world.yaml"
CAMERAS = ("front", "top")
SIZE = (960, 720)
START = (-0.5, 0.15, 1.1, -0.6)
"""Where the arm stands [rad, m, rad, rad]: in front of its column, in sight of both cameras."""


def make(robot: Robot, folder: Path) -> None:
    """Write a picture of a simulated robot's world for each camera."""
    for camera in CAMERAS:
        picture = Image.fromarray(robot.simulation.image(camera, SIZE))
        picture.quantize(128).save(folder / f"physics-{camera}.png", optimize=True)


def main(words: Sequence[str]) -> None:
    """Make the pictures of a file."""
    path, folder = (*(Path(word) for word in words), *(WORLD, IMAGES)[len(words) :])
    with Robot.simulated(world=path, homed=True) as robot:
        robot.move_joints(START)
        make(robot, folder)


if __name__ == "__main__":
    main(sys.argv[1:])
