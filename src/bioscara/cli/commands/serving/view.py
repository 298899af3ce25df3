"""``bioscara view``."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import FINGERS, share, share_target
from bioscara.errors import ConfigurationError
from bioscara.extras import install

if TYPE_CHECKING:
    from bioscara.model import ArmParameters
    from bioscara.planning.collision.scene import Scene
    from bioscara.viewer.live import Live
    from bioscara.viewer.page import Page
    from bioscara.viewer.player import Player
    from bioscara.viewer.sliders import Sliders

_PERIOD = 1.0 / 30.0
"""Time between two updates of the page [s]."""


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    parser.add_argument(
        "source",
        metavar="SOURCE",
        nargs="?",
        help="folder of a run, recording, trajectory file, sim:/path.sock for the arm that "
        "'bioscara simulate' runs, while a program uses it, or arm:NAME for one that "
        "'bioscara serve' runs (default: sliders, or the plan to the target)",
    )
    share(parser, "--from", help="joint positions at the start of the plan")
    share_target(parser, required=False)
    share(parser, "--full-speed", "--deg")
    share(
        parser,
        "--port",
        help="TCP port to listen on (default 8080); the next free one is taken if it is in use",
    )
    share(parser, "--scene", help="file with the zones and the table to show")
    share(
        parser,
        "--plot",
        help="at the end, draw the motion from the first to the last slider positions, as PNG",
    )
    parser.checks.append(_check)


def _check(parser: Parser, options: Options) -> None:
    """Refuse options of ``view`` that exclude one another."""
    planned = _has_target(options)
    if planned and options.source is not None:
        parser.error(f"{options.source} and a target exclude one another; leave out one of them")
    if options.plot is not None and (planned or options.source is not None):
        parser.error(
            "--plot of view draws the motion of the sliders; 'bioscara plan --plot FILE' draws a "
            "plan, and the folder of a run has plot.png"
        )
    given = {
        "--from": options.start is not None,
        "--table": options.table is not None,
        "--tool": options.tool != FINGERS,
        "--linear": options.linear,
        "--via": options.via is not None,
        "--velocity-scaling": options.velocity_scaling != 1.0,
        "--full-speed": options.full_speed,
    }
    for word, is_given in given.items():
        if is_given and not planned:
            parser.error(f"{word} applies to a planned motion; add --pose, --joints or --name")


def _has_target(options: Options) -> bool:
    return bool(options.name) or options.pose is not None or options.joints is not None


def run(options: Options, output: Output) -> None:
    """Show the arm in the browser until Ctrl-C, then draw the plot, if requested.

    Raises:
        ConfigurationError: viser is not installed, or a file cannot be read.
        InvalidArgumentError: The source cannot be shown, or the motion of the sliders cannot be
            drawn.
        BioscaraError: The motion cannot be planned, or there is no arm to look at.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.output.plots import require_drawing
    from bioscara.cli.signals import StopRequest

    try:
        # Installed by an extra.
        import viser  # noqa: F401
    except ModuleNotFoundError as error:
        if error.name != "viser":
            raise
        raise ConfigurationError(
            f"the 3D view needs viser, which is not installed: {install('view')}"
        ) from error
    require_drawing(options.plot)
    parameters = parameters_from(options)
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


def _opened(options: Options, parameters: ArmParameters) -> tuple[Page, Sliders | Player | Live]:
    """Return the page, and the source of its positions.

    Raises:
        BioscaraError: There is nothing to show, for a reason that the message gives.
    """
    from bioscara.cli.target import scene_from
    from bioscara.cli.view_source import (
        is_arm,
        look_at,
        plan_from,
        recording_from,
    )
    from bioscara.robot import kinematics_of
    from bioscara.robot.workspace.workspace import Workspace
    from bioscara.viewer.live import Live
    from bioscara.viewer.page import Page
    from bioscara.viewer.player import Player
    from bioscara.viewer.sliders import Sliders

    scene = Workspace.of(parameters).with_scene(scene_from(options)).surroundings
    arm = kinematics_of(parameters)
    if _has_target(options):
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
    from bioscara.cli.output.plots import write_picture
    from bioscara.robot.planner import Planner
    from bioscara.robot.workspace.workspace import Workspace

    here, there = ([places[joint.name] for joint in parameters.joints] for places in (start, goal))
    planner = Planner(Workspace.of(parameters).with_scene(scene), lambda: here)
    return write_picture(path, planner.move_joints(there), planner, parameters, "view")
