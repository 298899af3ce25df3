"""The files that ``--csv`` and ``--plot`` request."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from bioscara.cli.parser import Options
from bioscara.errors import InvalidArgumentError
from bioscara.model import ArmParameters
from bioscara.planning import write_csv
from bioscara.robot.planner import Plan, Planner


def require_files(options: Options) -> None:
    """Raise if ``--csv`` or ``--plot`` cannot be written; to be called before anything moves.

    Raises:
        InvalidArgumentError: As :func:`require_drawing`, for either file.
    """
    if options.csv is not None:
        _require_writable(options.csv)
    require_drawing(options.plot)


def require_drawing(plot: Path | None) -> None:
    """Raise if a plot is requested and cannot be drawn; to be called before anything moves.

    Raises:
        InvalidArgumentError: matplotlib is not installed, the name is not that of a PNG file, or
            the file cannot be written.
    """
    if plot is None:
        return
    _plan_png().require_matplotlib()
    _require_writable(plot)
    if plot.suffix.lower() != ".png":
        raise InvalidArgumentError(
            f"--plot {plot}: pictures are PNG; name a file that ends in .png, for example "
            f"{plot.with_suffix('.png')}"
        )


def _require_writable(path: Path) -> None:
    try:
        is_folder, has_folder = path.is_dir(), path.parent.is_dir()
    except OSError as error:
        raise _unwritable(path, error) from error
    if is_folder:
        raise InvalidArgumentError(f"{path} cannot be written: it is a folder; name a file in it")
    if not has_folder:
        raise InvalidArgumentError(f"{path} cannot be written: there is no folder {path.parent}")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InvalidArgumentError(f"{path} cannot be written: permission denied")


def write_files(
    options: Options, plan: Plan, planner: Planner, parameters: ArmParameters
) -> Iterator[str]:
    """Write the files of ``--csv`` and ``--plot``; yield a message that names each.

    Raises:
        InvalidArgumentError: One cannot be written.
    """
    if options.csv is not None:
        try:
            write_csv(options.csv, plan.trajectory)
        except OSError as error:
            raise _unwritable(options.csv, error) from error
        yield f"wrote {options.csv}"
    if options.plot is not None:
        yield write_picture(options.plot, plan, planner, parameters, options.command)


def write_picture(
    path: Path, plan: Plan, planner: Planner, parameters: ArmParameters, title: str
) -> str:
    """Draw a plan with the limits and the scene of its planner; return a message naming the file.

    Raises:
        InvalidArgumentError: The file cannot be written.
    """
    arm, scene = planner.kinematics, planner.workspace.scene
    try:
        _plan_png().write_plan(
            path, plan.trajectory, arm, parameters.joints, plan.tool, title, scene
        )
    except OSError as error:
        raise _unwritable(path, error) from error
    return f"wrote {path}"


def _plan_png() -> ModuleType:
    # Imported only for a picture, since it loads all of bioscara.report.
    from bioscara.report import plan_png  # noqa: PLC0415

    return plan_png


def _unwritable(path: Path, error: OSError) -> InvalidArgumentError:
    return InvalidArgumentError(f"{path} cannot be written: {error.strerror or error}")
