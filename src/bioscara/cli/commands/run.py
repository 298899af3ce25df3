"""``bioscara run FILE``."""

from __future__ import annotations

from bioscara.cli.arguments import Options
from bioscara.cli.job import prepare, run_job
from bioscara.cli.target import wanted_scene
from bioscara.model import load_parameters


def run(options: Options) -> int:
    """Check the trajectory file, home the arm, follow the trajectory and report.

    Raises:
        TrajectoryError: The file cannot be read, or its trajectory cannot be executed.
        BioscaraError: The run was refused or failed otherwise before anything moved.
    """
    parameters = load_parameters()
    plan = prepare(
        options.file,
        options.file.stem,
        str(options.file),
        parameters,
        wanted_scene(options),
        fit=options.fit,
        full_speed=options.full_speed,
    )
    return run_job(plan, parameters, options)
