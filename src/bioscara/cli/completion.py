"""What a shell completes: it runs ``bioscara`` itself, by the script of ``bioscara completion``."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import argcomplete
from argcomplete.completers import FilesCompleter, SuppressCompleter
from argcomplete.lexers import split_line

from bioscara.api import runtime
from bioscara.cli.parser import Options, Parser, parser_for
from bioscara.errors import BioscaraError

if TYPE_CHECKING:
    from bioscara.robot.workspace.poses import TeachTable

_OF_POSES = frozenset(("move", "plan", "view", "poses show", "poses delete"))
"""Commands whose name is that of a pose; that of others is new."""


def complete() -> None:
    """Write the words that can follow those in the environment, and end the process."""
    line = os.environ["COMP_LINE"]
    words = split_line(line, int(os.environ["COMP_POINT"]))[3]
    parser, _ = parser_for(words[1] if len(words) > 1 else "")
    _choose(parser)
    # An option is seldom wanted where a word is missing.
    argcomplete.autocomplete(
        parser, always_complete_options=False, default_completer=SuppressCompleter()
    )


def _choose(parser: Parser) -> None:
    """Choose for each argument whose values are files or known names how these are found."""
    command = parser.prog.partition(" ")[2]
    for action in parser._actions:  # noqa: SLF001  as argparse has no other list of them
        name = (action.option_strings or [action.dest])[0]
        if action.type is Path:
            action.completer = FilesCompleter()  # type: ignore[attr-defined]
        elif name == "--arm" or (command == "stop" and not action.option_strings):
            action.completer = _arms  # type: ignore[attr-defined]
        elif name == "--tool":
            action.completer = _tools  # type: ignore[attr-defined]
        elif name in {"--name", "name"} and command in _OF_POSES:
            action.completer = _poses  # type: ignore[attr-defined]
    for each in parser.commands.values():
        _choose(each)


def _arms(**_: object) -> list[str]:
    with suppress(BioscaraError):
        return [owner.name for owner in runtime.owners()]
    return []


def _poses(parsed_args: argparse.Namespace, **_: object) -> list[str]:
    return [pose.name for table in _table(parsed_args) for pose in table.all_poses()]


def _tools(parsed_args: argparse.Namespace, **_: object) -> list[str]:
    return [tool.name for table in _table(parsed_args) for tool in table.all_tools()]


def _table(parsed: argparse.Namespace) -> Iterator[TeachTable]:
    """Yield the poses and tools of the words so far; nothing if they cannot be read."""
    # Imported here: completion of another word does not wait for it.
    from bioscara.cli.teach_table import table_store  # noqa: PLC0415

    with (
        suppress(BioscaraError),
        table_store(Options(**vars(parsed)), changes=False, create=False) as store,
    ):
        yield store.table
