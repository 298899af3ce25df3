"""Programs that tests start end with the tests, however these end."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from programs import LIMIT, environment, running, wait_for_line, wait_until
from warm_python import Forked

PROGRAM = """
import os, subprocess, sys, time
inner = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
print("pids", os.getpid(), inner.pid, flush=True)
time.sleep(600)
"""
TEST = """
import sys, time
from programs import running, wait_for_line
with running("-c", sys.argv[1]) as process:
    print(wait_for_line(process, "pids"), end="", flush=True)
    time.sleep(600)
"""


def alive(number: str) -> bool:
    """Return whether a process has not ended."""
    with suppress(FileNotFoundError, ProcessLookupError):
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_programs_and_what_they_started_end_with_the_process_of_the_tests(
    number: signal.Signals,
) -> None:
    with running("-c", TEST, PROGRAM, env=environment(), stderr=subprocess.DEVNULL) as tests:
        _, *pids = wait_for_line(tests, "pids").split()
        assert all(map(alive, pids))
        os.kill(tests.pid, number)
        wait_until(lambda: not any(map(alive, pids)), "the programs end")


def test_the_end_of_a_block_ends_its_program_alone() -> None:
    with running("-c", PROGRAM) as other:
        _, *kept = wait_for_line(other, "pids").split()
        with running("-c", PROGRAM) as process:
            _, *pids = wait_for_line(process, "pids").split()
        wait_until(lambda: not any(map(alive, pids)), "the programs end")
        assert all(map(alive, kept))


SEEN = """
import atexit, json, os, random, signal, sys, threading
atexit.register(print, "at the end", flush=True)
print(json.dumps({
    "arguments": sys.argv[1:], "name": __name__, "folder": os.getcwd(),
    "GIVEN": os.environ["GIVEN"],
    "variables": "HOME" in os.environ, "first": sys.path[0],
    "leads": os.getpid() == os.getpgrp() == os.getsid(0), "threads": threading.active_count(),
    "signals": [str(signal.getsignal(each)) for each in range(1, 32)],
    "files": sorted(os.listdir("/proc/self/fd"), key=int)[:3], "wakeup": signal.set_wakeup_fd(-1),
    "streams": [sys.stdin.encoding, sys.stdout.encoding, sys.stdout.write_through],
    "read": sys.stdin.readline(),
}), flush=True)
print("an error", file=sys.stderr)
sys.exit(3)
"""


def seen(folder: Path, words: tuple[str, ...], *, cold: bool) -> tuple[object, ...]:
    """Return the surroundings of a program, its output and its exit status."""
    given = {"GIVEN": "value", "PYTHONPATH": str(folder)}
    env = {**{name: each for name, each in os.environ.items() if name != "HOME"}, **given}
    with running(
        *words,
        "one",
        "two",
        cold=cold,
        cwd=folder,
        env=env,
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert isinstance(process, Forked) is not cold
        told, errors = process.communicate("a line\n", LIMIT)
    first, *rest = told.splitlines()
    return json.loads(first), rest, errors, process.returncode


@pytest.mark.parametrize("kind", ["-c", "-m", "script"])
def test_a_forked_program_sees_and_does_what_one_that_was_started_does(
    tmp_path: Path, kind: str
) -> None:
    (tmp_path / "program.py").write_text(SEEN)
    words = {"-c": ("-c", SEEN), "-m": ("-m", "program"), "script": ("program.py",)}[kind]
    warm, cold = (seen(tmp_path, words, cold=each) for each in (False, True))
    assert warm == cold
    assert warm[1:] == (["at the end"], "an error\n", 3)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_forked_program_ends_by_a_signal(number: signal.Signals) -> None:
    with running("-c", "import time; print(1); time.sleep(60)", stderr=subprocess.PIPE) as process:
        wait_for_line(process, "1")
        assert process.poll() is None
        process.send_signal(number)
        _, errors = process.communicate(timeout=LIMIT)
    assert process.returncode == -number
    assert errors.endswith("KeyboardInterrupt\n" if number == signal.SIGINT else "")
    assert "warm_python.py" not in errors


@pytest.mark.parametrize(
    ("words", "options"),
    [
        (("-X", "dev", "-c", "0"), {}),
        (("-c", "0"), {"env": {**os.environ, "PYTHONHASHSEED": "1"}}),
        (("-c", "0"), {"env": {**os.environ, "LD_PRELOAD": ""}}),
        (("-c", "0"), {"preexec_fn": os.getpid}),
    ],
)
def test_a_program_that_needs_an_interpreter_of_its_own_gets_one(
    words: tuple[str, ...], options: dict[str, Any]
) -> None:
    with running(*words, **options) as process:
        assert not isinstance(process, Forked)


def test_forked_programs_draw_different_random_numbers() -> None:
    draw = "import random, numpy; print(random.random(), numpy.random.random())"
    numbers = set()
    for _ in range(2):
        with running("-c", draw) as process:
            numbers |= set(process.communicate(timeout=LIMIT)[0].split())
    assert len(numbers) == 4
