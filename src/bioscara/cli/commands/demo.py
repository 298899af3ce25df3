"""``bioscara demo``."""

from __future__ import annotations

from importlib.resources import as_file, files

from bioscara.cli.arguments import Options
from bioscara.cli.commands.run import prepare, run_job
from bioscara.cli.parameters import parameters_from
from bioscara.planning.collision.scene import Scene


def run(options: Options) -> int:
    """Home the arm, follow the trajectory supplied with the package, report.

    Raises:
        BioscaraError: The run was refused or failed before anything moved.
    """
    parameters = parameters_from(options)
    with as_file(files("bioscara.cli").joinpath("demo.csv")) as path:
        job = prepare(
            path,
            "demo",
            "demonstration: lower, lift, swing over",
            parameters,
            Scene(),
            full_speed=options.full_speed,
        )
    return run_job(job, parameters, options)
