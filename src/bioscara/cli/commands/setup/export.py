"""``bioscara export``."""

from __future__ import annotations

from pathlib import Path

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share


def arguments(parser: Parser) -> None:
    parser.add_argument(
        "format",
        metavar="FORMAT",
        choices=("mjcf", "urdf", "glb"),
        help="mjcf for MuJoCo, urdf for pinocchio, Gazebo, MuJoCo and others, or glb, the look of "
        "the arm for viewers and Blender",
    )
    parser.add_argument(
        "folder", metavar="DIR", type=Path, help="new folder for the files, or an empty one"
    )
    share(parser, "--parameters")


def run(options: Options, output: Output) -> None:
    """Write the model of the arm."""
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.export.model_files import export_model

    first, *meshes = export_model(options.format, options.folder, parameters_from(options))
    beside = f" and {len(meshes)} meshes that it names" if meshes else ""
    output.line(f"wrote {options.folder / first}{beside}")
