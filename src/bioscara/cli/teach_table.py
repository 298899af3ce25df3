"""The poses and tools of ``--table``."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from bioscara.cli.arguments import Options
from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.robot.workspace.poses import TeachTable
from bioscara.robot.workspace.teach_file import load_table
from bioscara.robot.workspace.tools import Tool

T = TypeVar("T")


def read_table(options: Options, tool: Tool) -> TeachTable:
    """Return the poses and tools of ``--table``; the built-in ones if there is no such file.

    Args:
        options: Parsed options.
        tool: The fingers.

    Raises:
        ConfigurationError: The file cannot be read; names file and line.
    """
    try:
        return load_table(options.table, tool)
    except ConfigurationError as error:
        if isinstance(error.__cause__, FileNotFoundError):
            return TeachTable(tool)
        raise


def lookup(options: Options, find: Callable[[str], T], name: str) -> T:
    """Return the named entry of ``--table``; the error message mentions a missing file.

    Raises:
        InvalidArgumentError: There is no entry of that name.
    """
    try:
        return find(name)
    except InvalidArgumentError as error:
        if options.table.exists():
            raise
        raise InvalidArgumentError(
            f"{error} (and {options.table} does not exist; name another file with --table)"
        ) from error
