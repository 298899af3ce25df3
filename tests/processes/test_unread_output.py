"""Lines without a wait for their reader: whole, in order, counted where they are left out."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from programs import LIMIT, environment, wait_for_line, wait_until
from unread import KINDS, Unread, unread

Start = Callable[..., subprocess.Popen[str]]

MANY = 20_000
"""Lines of 50 bytes: more than the program keeps."""
PRINTING = f"""
import sys
from bioscara.processes.unread_output import finish, never_wait

never_wait()
written = getattr(sys, sys.argv[1])
other = sys.stderr if written is sys.stdout else sys.stdout
sys.stdin.readline()
for number in range({MANY}):
    print(f"line {{number:05}}".ljust(49, "."), file=written)
print("printed", file=other)
sys.stdin.readline()
for number in range(3):
    print(f"later {{number}}", file=written)
print("ending", file=other)
sys.stdin.readline()
"""


def answer(program: subprocess.Popen[str]) -> None:
    """Let the program go on."""
    assert program.stdin
    program.stdin.write("\n")
    program.stdin.flush()


def printing(start: Start, output: Unread, stream: str) -> subprocess.Popen[str]:
    """Start the program, whose ``stream`` is not read; its other one is read as ``stdout``."""
    files = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, stream: output.written}
    words = ("-c", PRINTING, stream)
    program = start(*words, env=environment(), stdin=subprocess.PIPE, **files)
    program.stdout = program.stdout or program.stderr
    output.block()
    return program


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_lines_are_whole_and_in_order_and_what_is_left_out_is_counted(
    start: Start, kind: str, stream: str
) -> None:
    with unread(kind) as output:
        program = printing(start, output, stream)
        answer(program)
        wait_for_line(program, "printed")
        output.read()
        text = output.wait_for(r"left out here, as the output was not read: \d+\n")
        answer(program)
        lines = output.wait_for("later 2\n")[len(text) :].splitlines()
        assert [each for each in lines if each] == ["later 0", "later 1", "later 2"]
        *lines, note = filter(None, text.splitlines())
        assert lines == [f"line {each:05}".ljust(49, ".") for each in range(len(lines))]
        assert note.startswith("note: lines left out here")
        assert len(lines) + int(note.split()[-1]) == MANY
        assert len(lines) > 5_000
        answer(program)
        assert program.wait(LIMIT) == 0


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_the_end_waits_half_a_second_for_the_reader(start: Start, stream: str) -> None:
    with unread() as output:
        program = printing(start, output, stream)
        for word in ("printed", "ending"):
            answer(program)
            wait_for_line(program, word)
        begin = time.monotonic()
        answer(program)
        assert program.wait(LIMIT) == 0
        assert 0.4 < time.monotonic() - begin < 2.0


OTHERS = """
import ctypes, socket, sys, time
from bioscara.processes.unread_output import never_wait
from bioscara.processes.nursery import spawn, start_early

def end_of_child():
    ours, theirs = socket.socketpair()
    with ours, theirs:
        spawn(int, sockets=[theirs])
        theirs.close()
        ours.recv(1)

never_wait(lambda: start_early(["bioscara.units"], fork=True), all_of_c=True)
sys.stdin.readline()
end_of_child()
libc = ctypes.PyDLL(None)  # which keeps the interpreter's lock
for _ in range(40):
    for _ in range(120):
        libc.dprintf(1, b"%0100d\\n", 1)
        libc.dprintf(2, b"%0100d\\n", 2)
    time.sleep(0.02)
for _ in range(2000):
    libc.dprintf(2, b"%0100d\\n", 2)
with open("done", "w"):
    pass
sys.stdin.readline()
end_of_child()
libc.dprintf(2, b"the last line")
"""


def test_neither_code_in_c_nor_a_child_waits(start: Start, tmp_path: Path) -> None:
    with unread() as output:
        program = start(
            *("-c", OTHERS),
            cold=True,
            env=environment(),
            cwd=tmp_path,
            stdin=subprocess.PIPE,
            stdout=output.written,
            stderr=output.written,
        )
        output.block()
        answer(program)
        wait_until((tmp_path / "done").exists, "all is written")
        output.read()
        output.wait_for(r"(?s)int\(\) argument.*left out here")
        answer(program)
        assert program.wait(LIMIT) == 0
        text = output.wait_for("the last line")
        assert text.count("TypeError: int() argument") == 2
        assert {len(each) for each in re.findall("^0+.$", text, re.MULTILINE)} == {100}


@pytest.mark.parametrize(
    ("closed", "status", "error"),
    [
        ("stdout", 1, ""),
        ("stderr", 0, ""),
        ("full", 1, "bioscara: the output cannot be written: No space left on device\n"),
    ],
)
def test_a_closed_output_stays_an_error(
    start: Start, tmp_path: Path, closed: str, status: int, error: str
) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with open("/dev/full", "w") as full, open(tmp_path / "error", "w") as kept:
        files: dict[str, int] = {"stdout": full.fileno(), "stderr": kept.fileno()}
        if closed != "full":
            files |= {"stdout": subprocess.DEVNULL, closed: writing}
        program = start(
            *("-m", "bioscara", "simulate", "--socket", "arm.sock"),
            env=environment(),
            cwd=tmp_path,
            **files,
        )
    os.close(writing)
    wait_until((tmp_path / "arm.sock").exists, "a socket")
    program.send_signal(signal.SIGTERM)
    assert program.wait(LIMIT) == status
    assert (tmp_path / "error").read_text() == error
