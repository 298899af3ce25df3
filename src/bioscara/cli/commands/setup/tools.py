"""``bioscara tools``."""

from __future__ import annotations

from contextlib import nullcontext

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.options import Options
from bioscara.cli.output.angles import angle_unit
from bioscara.cli.output.console import ExitStatus, Output, columns
from bioscara.cli.teach_table import read_table, refuse_overwriting, table_file, tool_rows
from bioscara.kinematics import Pose
from bioscara.model import ArmParameters
from bioscara.robot.workspace.teach_file import changing, save_table
from bioscara.robot.workspace.tools import Tool, fingers


def run(options: Options) -> int:
    """List the tools, or add one to the teach file.

    Raises:
        InvalidArgumentError: The tool exists already, or a value is not possible.
        ConfigurationError: The file cannot be read or written.
        OSError: Standard output cannot be written.
    """
    output, parameters = Output(), parameters_from(options)
    adding = options.action == "add"
    with changing(table_file(options)) if adding else nullcontext():
        lines = (_add if adding else _list)(options, parameters)
    for line in lines:
        output.line(line)
    output.check()
    return ExitStatus.OK


def _list(options: Options, parameters: ArmParameters) -> list[str]:
    table = read_table(options, fingers(parameters))
    return columns(tool_rows(table, angle_unit(options)))


def _add(options: Options, parameters: ArmParameters) -> list[str]:
    table = read_table(options, fingers(parameters), create=True)
    tool = Tool(options.name, Pose(*options.offset), options.mass)
    refuse_overwriting("tool", tool.name, table.tools, options)
    save_table(table_file(options), table.with_tool(tool, overwrite=options.force))
    return [f"added {tool.name} to {table_file(options)}; mounted, it is --tool {tool.name}"]
