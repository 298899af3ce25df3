"""Keys are read one by one from a terminal, which is left as it was."""

from __future__ import annotations

import os
import pty
import termios
from collections.abc import Iterator

import pytest

from bioscara.cli.terminal.keyboard import Keyboard
from bioscara.errors import InvalidArgumentError


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    """A terminal: where the user types, and where the program reads."""
    user, program = pty.openpty()
    yield user, program
    for descriptor in (user, program):
        os.close(descriptor)


def test_arrows_arrive_whole_even_if_they_are_sent_in_parts(terminal: tuple[int, int]) -> None:
    user, program = terminal
    with Keyboard(program) as keyboard:
        assert keyboard.read() == []
        keys = []
        for part in (b"w\x1b[A\x1bO", b"Dx\x1b", b"[", b"5~q"):
            os.write(user, part)
            keys += keyboard.read()
        assert keys == ["w", "up", "left", "x", "q"]


def test_keys_are_not_echoed_and_ctrl_z_does_not_suspend(terminal: tuple[int, int]) -> None:
    user, program = terminal
    before = termios.tcgetattr(program)
    with Keyboard(program):
        inside = termios.tcgetattr(program)
        assert not inside[3] & (termios.ECHO | termios.ICANON)
        assert inside[3] & termios.ISIG
        assert inside[6][termios.VSUSP] == b"\0"
        os.write(user, b"late")
    assert termios.tcgetattr(program) == before


def test_a_stream_that_is_no_terminal_is_refused() -> None:
    reader, writer = os.pipe()
    with pytest.raises(InvalidArgumentError, match="run it in a terminal"):
        Keyboard(reader)
    os.close(reader)
    os.close(writer)
