"""``bioscara demo``."""

from __future__ import annotations

from importlib.resources import as_file, files
from typing import TYPE_CHECKING

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share

if TYPE_CHECKING:
    from bioscara.cli.runs.job import Job
    from bioscara.model import ArmParameters


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    parser.add_argument(
        "--watch",
        action="store_true",
        help="serve the simulated arm, open its page in the browser, move it there in real time, "
        "and go on until Ctrl-C; needs the packages of bioscara[web]",
    )
    parser.add_argument(
        "--fast", action="store_true", help="do not hold the simulation back to real time"
    )
    share(parser, "--out")
    share_arm(parser, owned=False)
    share(parser, "--acknowledge", "--realtime", "--full-speed", "--deg", "--rate", "--priority")


def run(options: Options, output: Output) -> ExitStatus:
    """Home the arm, carry the plate of the package and report; or follow its trajectory."""
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.runs import job
    from bioscara.physics.engine import is_installed

    parameters = parameters_from(options)
    options.paced = options.paced and not options.fast
    if options.bus == "sim" and is_installed():
        from bioscara.cli.runs.carry import CarryJob, demo_world

        options.world = demo_world()
        demo: job.AnyJob = CarryJob(options.world)
    else:
        demo = trajectory(options, parameters, output)

    def demonstrate() -> ExitStatus:
        return job.run_job(demo, parameters, options, output)

    if not options.watch:
        return demonstrate()
    # Without the page, nothing of it is needed.
    from bioscara.cli.runs.watch import watch

    return watch(demonstrate, parameters, options, output)


def trajectory(options: Options, parameters: ArmParameters, output: Output) -> Job:
    """Return the demonstration for an arm without a simulated world, and say why it is this one."""
    from bioscara.cli.runs import job
    from bioscara.extras import install
    from bioscara.planning.collision.scene import Scene

    if options.bus == "sim":
        output.line(
            "note: without the physics engine the demonstration is a trajectory; it carries a "
            f"plate with {install('physics')}"
        )
    with as_file(files("bioscara.cli.runs").joinpath("demo.csv")) as path:
        return job.prepare(
            path,
            "demo",
            "demonstration: lower, lift, swing over",
            parameters,
            Scene(),
            full_speed=options.full_speed,
        )
