"""``bioscara tools``."""

from __future__ import annotations

from bioscara.cli.options import Options
from bioscara.cli.output.angles import angle_unit
from bioscara.cli.output.console import ExitStatus, Output, columns
from bioscara.cli.teach_table import TableStore, refuse_overwriting, table_store, tool_rows
from bioscara.kinematics import Pose
from bioscara.robot.workspace.tools import Tool


def run(options: Options) -> int:
    """List the tools, or add one to the teach file.

    Raises:
        InvalidArgumentError: The tool exists already, or a value is not possible.
        ConfigurationError: The file cannot be read or written.
        OSError: Standard output cannot be written.
    """
    output, adding = Output(), options.action == "add"
    with table_store(options, changes=adding, create=adding) as store:
        lines = (_add if adding else _list)(options, store)
    for line in lines:
        output.line(line)
    output.check()
    return ExitStatus.OK


def _list(options: Options, store: TableStore) -> list[str]:
    return columns(tool_rows(store.table, angle_unit(options)))


def _add(options: Options, store: TableStore) -> list[str]:
    table = store.table
    tool = Tool(options.name, Pose(*options.offset), options.mass)
    refuse_overwriting("tool", tool.name, table.tools, store, options)
    store.save(table.with_tool(tool, overwrite=options.force))
    return [f"added {tool.name} to {store.where}; mounted, it is --tool {tool.name}"]
