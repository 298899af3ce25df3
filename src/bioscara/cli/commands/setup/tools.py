"""``bioscara tools``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bioscara.cli.output.console import Output, columns
from bioscara.cli.parser import Options, Parser, number
from bioscara.cli.shared_arguments import POSE, share, share_taught

if TYPE_CHECKING:
    from bioscara.cli.teach_table import TableStore


def arguments(parser: Parser) -> None:
    parser.take_commands("action", "ACTION")
    listing = parser.add_command("list", "List all tools.")
    add = parser.add_command("add", "Add a tool under a name.")
    for action in (listing, add):
        share(action, "--parameters")
        share_taught(action)
    add.add_argument("name", metavar="NAME", help="name of the tool")
    add.add_argument(
        "--offset",
        metavar=POSE,
        type=number,
        nargs=4,
        required=True,
        help="its centre point in the flange [m m m rad]",
    )
    add.add_argument("--mass", metavar="KG", type=number, required=True, help="its mass [kg]")
    share(add, "--force", help="replace the tool of this name, if there is one")


def run(options: Options, output: Output) -> None:
    """List the tools, or add one to the teach file.

    Raises:
        InvalidArgumentError: The tool exists already, or a value is not possible.
        ConfigurationError: The file cannot be read or written.
    """
    from bioscara.cli.teach_table import table_store

    adding = options.action == "add"
    with table_store(options, changes=adding, create=adding) as store:
        lines = (_add if adding else _list)(options, store)
    output.lines(lines)


def _list(options: Options, store: TableStore) -> list[str]:
    from bioscara.cli.output.angles import angle_unit
    from bioscara.cli.teach_table import tool_rows

    return columns(tool_rows(store.table, angle_unit(options)))


def _add(options: Options, store: TableStore) -> list[str]:
    from bioscara.cli.teach_table import refuse_overwriting
    from bioscara.kinematics import Pose
    from bioscara.robot.workspace.tools import Tool

    table = store.table
    tool = Tool(options.name, Pose(*options.offset), options.mass)
    refuse_overwriting("tool", tool.name, table.tools, store, options)
    store.save(table.with_tool(tool, overwrite=options.force))
    return [f"added {tool.name} to {store.where}; mounted, it is --tool {tool.name}"]
