"""Tables fit in the terminal; problems are in colour there, and only there."""

from __future__ import annotations

import os
import pty
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from bioscara.cli.output.console import columns, complain

ROWS = [[f"cell {row}{column}" + "." * 4 * column for column in range(6)] for row in range(3)]


@contextmanager
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A terminal as standard output and error; the descriptor to read from."""
    reader, writer = pty.openpty()
    monkeypatch.setenv("TERM", "xterm")
    with os.fdopen(writer, "w") as file, monkeypatch.context() as changed:
        changed.setattr(sys, "stdout", file)
        changed.setattr(sys, "stderr", file)
        yield reader
    os.close(reader)


@pytest.mark.parametrize("width", [60, 80, 120, 200])
def test_a_table_is_continued_below_where_it_would_be_wrapped(
    width: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    with terminal(monkeypatch):
        lines = columns(ROWS)
    assert max(map(len, lines)) <= width
    for row in ROWS:
        assert sum(line.startswith(row[0]) for line in lines) == lines.count("") + 1
        assert all(any(cell in line for line in lines) for cell in row)


def test_elsewhere_a_table_is_as_wide_as_it_is() -> None:
    assert len(columns(ROWS)) == len(ROWS)


@pytest.mark.parametrize("no_color", ["", "1"])
def test_colour_is_for_terminals_without_no_color(
    no_color: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_COLOR", no_color)
    with terminal(monkeypatch) as reader:
        complain("the arm is away")
        sys.stderr.flush()
        said = os.read(reader, 200).decode()
    assert ("\x1b[" in said) == (no_color == "")
    assert "the arm is away" in said
