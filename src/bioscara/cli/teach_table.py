"""The poses and tools of ``--table``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeVar

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.output.angles import AngleUnit
from bioscara.cli.owner_link import served_robot
from bioscara.cli.parser import Options
from bioscara.cli.shared_arguments import TABLE
from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.model import ArmParameters
from bioscara.robot.workspace.poses import NamedPose, TeachTable
from bioscara.robot.workspace.teach_file import changing, load_table, save_table
from bioscara.robot.workspace.tools import Tool, fingers

T = TypeVar("T")


def table_file(options: Options) -> Path:
    """Return the file with the poses: that of ``--table``, or the default one."""
    return TABLE if options.table is None else options.table


def read_table(options: Options, tool: Tool, *, create: bool = False) -> TeachTable:
    """Return the poses and tools of ``--table``.

    Without ``--table``, and to create the file, it need not exist: then these are the built-in
    poses and tools.

    Args:
        options: Parsed options.
        tool: The fingers.
        create: Whether the file may be missing although it is named, as it is to be saved.

    Raises:
        ConfigurationError: The file cannot be read, or does not exist; names file and line.
    """
    try:
        return load_table(table_file(options), tool)
    except ConfigurationError as error:
        if not isinstance(error.__cause__, FileNotFoundError):
            raise
        if options.table is None or create:
            return TeachTable(tool)
        raise ConfigurationError(
            f"--table {options.table} does not exist; correct its name, or create it with "
            f"'bioscara poses save NAME --table {options.table} ...'"
        ) from error


class TableStore(NamedTuple):
    """Poses and tools, and where they are kept.

    Attributes:
        table: The poses and tools.
        where: The file, or the arm, in words.
        parameters: Parameters of the arm.
        save: Keeps others in their place.
    """

    table: TeachTable
    where: str
    parameters: ArmParameters
    save: Callable[[TeachTable], object]


@contextmanager
def table_store(options: Options, *, changes: bool, create: bool) -> Iterator[TableStore]:
    """Yield the poses of the arm of ``--arm``, or those of ``--table``.

    Args:
        options: Parsed options.
        changes: Whether they are to be changed: other commands then wait.
        create: Whether the file may be missing although it is named.

    Raises:
        ConfigurationError: The file cannot be read, or does not exist; names file and line.
        OwnerLostError: No owner of that name runs.
    """
    if options.arm is not None:
        with served_robot(options) as robot:
            save = partial(setattr, robot, "table")
            yield TableStore(robot.table, f"arm {options.arm}", robot.parameters, save)
        return
    parameters, file = parameters_from(options), table_file(options)
    with changing(file) if changes else nullcontext():
        # What is changed and not created has to exist, also the default one.
        table = (
            load_table(file, fingers(parameters))
            if changes and not create
            else read_table(options, fingers(parameters), create=create)
        )
        yield TableStore(table, str(file), parameters, partial(save_table, file))


def lookup(options: Options, find: Callable[[str], T], name: str) -> T:
    """Return the named entry of ``--table``; the error message mentions where it was looked for.

    Raises:
        InvalidArgumentError: There is no entry of that name.
    """
    try:
        return find(name)
    except InvalidArgumentError as error:
        if options.command in {"poses", "tools"} and options.arm is not None:
            raise
        if options.arm is not None and options.table is None:
            raise InvalidArgumentError(
                f"{error} (these are the poses that the owner of {options.arm} has; --table FILE "
                f"gives it those of a file, such as {TABLE})"
            ) from error
        if table_file(options).exists():
            raise
        raise InvalidArgumentError(
            f"{error} (and {table_file(options)} does not exist; name another file with --table)"
        ) from error


def refuse_overwriting(
    what: str, name: str, entries: Iterable[NamedPose | Tool], store: TableStore, options: Options
) -> None:
    """Refuse a name that is taken, unless ``--force`` is given.

    Raises:
        InvalidArgumentError: One of the entries has that name.
    """
    if not options.force and any(entry.name == name for entry in entries):
        raise InvalidArgumentError(
            f"there is a {what} {name} in {store.where} already; choose another name, or "
            "replace it with --force"
        )


def tool_rows(table: TeachTable, angles: AngleUnit) -> list[tuple[str, str, str]]:
    """Return the tools of a table as rows, below their headings."""
    return [
        ("tool", f"offset in the flange [m m m {angles.name}]", "mass [kg]"),
        *(
            (tool.name, angles.numbers(tool.pose_tool_in_flange), f"{tool.mass:g}")
            for tool in table.all_tools()
        ),
    ]
