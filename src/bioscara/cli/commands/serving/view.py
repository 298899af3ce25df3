"""``bioscara view``."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.output.plots import require_drawing, write_picture
from bioscara.cli.signals import StopRequest
from bioscara.cli.target import scene_from
from bioscara.errors import ConfigurationError
from bioscara.extras import install
from bioscara.model import ArmParameters
from bioscara.planning.collision.scene import Scene
from bioscara.robot import kinematics_of
from bioscara.robot.planner import Planner
from bioscara.robot.workspace.workspace import Workspace

if TYPE_CHECKING:
    from bioscara.viewer.live import Live
    from bioscara.viewer.page import Page
    from bioscara.viewer.player import Player
    from bioscara.viewer.sliders import Sliders

_PERIOD = 1.0 / 30.0
"""Time between two updates of the page [s]."""


def run(options: Options) -> int:
    """Show the arm in the browser until Ctrl-C, then draw the plot, if requested.

    Raises:
        ConfigurationError: viser is not installed, or a file cannot be read.
        InvalidArgumentError: What to show is not possible, or the motion of the sliders cannot be
            drawn.
        BioscaraError: The motion cannot be planned, or there is no arm to look at.
        OSError: Standard output cannot be written.
    """
    try:
        # Imported here: it takes a second to import, and is installed by an extra.
        import viser  # noqa: F401, PLC0415
    except ModuleNotFoundError as error:
        if error.name != "viser":
            raise
        raise ConfigurationError(
            f"the 3D view needs viser, which is not installed: {install('view')}"
        ) from error
    require_drawing(options.plot)
    output, parameters = Output(), parameters_from(options)
    with StopRequest() as cancelled:
        page, panel = _opened(options, parameters)
        start = dict(page.positions)
        try:
            output.line(f"the arm in 3D: {page.url} (from this computer only; Ctrl-C ends it)")
            while not cancelled():
                panel.step(time.monotonic())
                time.sleep(_PERIOD)
        finally:
            page.close()
    if options.plot is not None:
        output.line(_drawn(options.plot, start, page.positions, page.scene, parameters))
    output.check()
    return ExitStatus.OK


def _opened(options: Options, parameters: ArmParameters) -> tuple[Page, Sliders | Player | Live]:
    """Return the page, and what decides which positions it shows.

    Raises:
        BioscaraError: There is nothing to show, for a reason that the message gives.
    """
    # Imported here, as viser may be missing.
    from bioscara.cli.view_source import (  # noqa: PLC0415
        is_arm,
        look_at,
        plan_from,
        recording_from,
    )
    from bioscara.viewer.live import Live  # noqa: PLC0415
    from bioscara.viewer.page import Page  # noqa: PLC0415
    from bioscara.viewer.player import Player  # noqa: PLC0415
    from bioscara.viewer.sliders import Sliders  # noqa: PLC0415

    scene = Workspace.of(parameters).with_scene(scene_from(options)).surroundings
    arm = kinematics_of(parameters)
    if options.has_target():
        recording, arm = plan_from(options, parameters)
    elif options.source is None:
        page = Page(options.port, scene, arm, parameters)
        return page, Sliders(page)
    elif is_arm(options.source):
        look = look_at(options.source)
        page = Page(options.port, scene, arm, parameters)
        return page, Live(page, options.source, look)
    else:
        recording = recording_from(options, parameters, scene, arm)
    page = Page(options.port, scene, arm, parameters)
    return page, Player(page, recording)


def _drawn(
    path: Path,
    start: Mapping[str, float],
    goal: Mapping[str, float],
    scene: Scene,
    parameters: ArmParameters,
) -> str:
    """Draw the motion between two slider positions; return a message that names the file.

    Raises:
        InvalidArgumentError: The path is not free, or the file cannot be written.
    """
    here, there = ([places[joint.name] for joint in parameters.joints] for places in (start, goal))
    planner = Planner(Workspace.of(parameters).with_scene(scene), lambda: here)
    return write_picture(path, planner.move_joints(there), planner, parameters, "view")
