"""``bioscara demo``."""

from __future__ import annotations

from importlib.resources import as_file, files

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    parser.add_argument(
        "--watch",
        action="store_true",
        help="serve the simulated arm, open its page in the browser, move it there in real time, "
        "and go on until Ctrl-C; needs the packages of bioscara[web]",
    )
    share(parser, "--out")
    share_arm(parser, owned=False)
    share(parser, "--acknowledge", "--realtime", "--full-speed", "--deg", "--rate", "--priority")


def run(options: Options, output: Output) -> ExitStatus:
    """Home the arm, follow the trajectory of the package and report."""
    from bioscara.cli import job
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.planning.collision.scene import Scene

    parameters = parameters_from(options)
    with as_file(files("bioscara.cli").joinpath("demo.csv")) as path:
        demo = job.prepare(
            path,
            "demo",
            "demonstration: lower, lift, swing over",
            parameters,
            Scene(),
            full_speed=options.full_speed,
        )

    def demonstrate() -> ExitStatus:
        return job.run_job(demo, parameters, options, output)

    if not options.watch:
        return demonstrate()
    # Without the page, nothing of it is needed.
    from bioscara.cli.watch import watch

    return watch(demonstrate, parameters, options, output)
