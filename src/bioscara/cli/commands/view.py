"""``bioscara view``."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

from bioscara.cli.arguments import Options
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.output.plots import require_drawing, write_picture
from bioscara.cli.signals import StopRequest
from bioscara.cli.target import scene_from
from bioscara.errors import ConfigurationError
from bioscara.model import load_parameters
from bioscara.planning.collision.scene import Scene
from bioscara.robot.planner import Planner
from bioscara.robot.workspace.workspace import Workspace


def run(options: Options) -> int:
    """Show the arm's description in the browser until Ctrl-C, then draw the plot, if requested.

    Raises:
        ConfigurationError: viser is not installed, or the scene cannot be read.
        InvalidArgumentError: The motion of the sliders cannot be drawn or is not possible.
        OSError: Standard output cannot be written.
    """
    try:
        # Imported here: it takes a second to import, and is installed by an extra.
        from bioscara.viewer.page import Page  # noqa: PLC0415
    except ModuleNotFoundError as error:
        if error.name != "viser":
            raise
        raise ConfigurationError(
            "the 3D view needs viser, which is not installed: pip install 'bioscara[view]'"
        ) from error
    require_drawing(options.plot)
    output, scene = Output(), scene_from(options)
    page = Page(options.port, scene)
    start = dict(page.positions)
    try:
        with StopRequest() as cancelled:
            output.line(f"the arm in 3D: {page.url} (from this computer only; Ctrl-C ends it)")
            while not cancelled():
                time.sleep(0.1)
    finally:
        page.close()
    if options.plot is not None:
        output.line(_drawn(options.plot, start, page.positions, scene))
    output.check()
    return ExitStatus.OK


def _drawn(path: Path, start: Mapping[str, float], goal: Mapping[str, float], scene: Scene) -> str:
    """Draw the motion between two slider positions; return a message that names the file.

    Raises:
        InvalidArgumentError: The path is not free, or the file cannot be written.
    """
    parameters = load_parameters()
    here, there = ([places[joint.name] for joint in parameters.joints] for places in (start, goal))
    planner = Planner(Workspace.of(parameters).with_scene(scene), lambda: here)
    return write_picture(path, planner.move_joints(there), planner, parameters, "view")
