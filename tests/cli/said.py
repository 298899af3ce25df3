"""Commands as a user types them, with what they write."""

from __future__ import annotations

import shlex
from typing import NamedTuple

import pytest

from bioscara.cli import main


class Outcome(NamedTuple):
    """The status of a command, and what it wrote to standard output and standard error."""

    status: int
    out: str
    err: str


class Said:
    """Runs commands in this process, in simulated time that does not wait for real time.

    A command is given as typed into a shell, and further words of it as they are.
    """

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys

    def __call__(self, command: str, *words: str) -> Outcome:
        """Run a command and return its outcome."""
        self._capsys.readouterr()
        try:
            status = main((*shlex.split(command), *words), paced=False)
        except SystemExit as ended:
            status = int(ended.code or 0)
        return Outcome(status, *self._capsys.readouterr())

    def output(self, command: str, *words: str) -> str:
        """Run a command that succeeds without an error, and return its output."""
        status, out, err = self(command, *words)
        assert (status, err) == (0, "")
        return out

    def refusal(self, command: str, *words: str, status: int = 2) -> str:
        """Run a command that says nothing but one line, and return that error."""
        outcome = self(command, *words)
        assert (outcome.status, outcome.out) == (status, "")
        return _one_line(outcome.err)

    def failure(self, command: str, *words: str, status: int = 2) -> str:
        """Run a command that fails after some output, and return its error of one line."""
        outcome = self(command, *words)
        assert outcome.status == status
        return _one_line(outcome.err)


def _one_line(error: str) -> str:
    assert len(error.splitlines()) == 1, error
    return error
