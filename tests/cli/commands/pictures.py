"""Pictures that commands should have drawn."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

from bioscara.model import load_parameters
from bioscara.planning.collision.scene import Scene
from bioscara.report.plan_png import write_plan
from bioscara.robot.planner import Planner
from bioscara.robot.workspace.workspace import Workspace

PARAMETERS = load_parameters()


def expected(
    folder: Path,
    start: Sequence[float],
    goal: Sequence[float],
    title: str,
    scene: Scene | None = None,
) -> bytes:
    """Return the picture of a motion from one place of the joints to another, with all limits."""
    workspace = Workspace.of(PARAMETERS).with_scene(scene or Scene())
    planner = Planner(workspace, lambda: start)
    path = folder / "expected.png"
    plan = planner.move_joints(goal)
    arm = planner.kinematics
    write_plan(path, plan.trajectory, arm, PARAMETERS.joints, plan.tool, title, workspace.scene)
    return path.read_bytes()


def size(path: Path) -> tuple[int, int]:
    """Return width and height of a picture, after making sure that all of it can be read."""
    from matplotlib.image import imread  # noqa: PLC0415

    pixels = imread(path)
    assert pixels.std() > 0.05
    width, height = struct.unpack(">II", path.read_bytes()[16:24])
    assert pixels.shape[:2] == (height, width)
    return width, height
