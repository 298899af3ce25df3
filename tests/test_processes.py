"""Programs that tests start end with the tests, however these end."""

from __future__ import annotations

import os
import signal
import subprocess
from contextlib import suppress
from pathlib import Path

import pytest

from processes import environment, running, wait_for_line, wait_until

PROGRAM = """
import os, subprocess, sys, time
inner = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
print("pids", os.getpid(), inner.pid, flush=True)
time.sleep(600)
"""
TEST = """
import sys, time
from processes import running, wait_for_line
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
