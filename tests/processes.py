"""Programs that a test starts; each ends with the test, with all processes that it started."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

LIMIT = 20.0
"""Time after which a condition that is waited for counts as never met [s]."""
_ROOT = Path(__file__).parents[1]


@contextmanager
def running(*arguments: str, **options: object) -> Iterator[subprocess.Popen[str]]:
    """Run a Python program in a process group of its own, which is killed at the end of the block.

    Args:
        *arguments: Of the interpreter: ``"-m", "bioscara", "demo"``.
        **options: Of :class:`subprocess.Popen`; by default standard output is a pipe.
    """
    with subprocess.Popen(
        [sys.executable, "-u", *arguments],
        **{"stdout": subprocess.PIPE, "text": True, "start_new_session": True, **options},  # type: ignore[call-overload]
    ) as process:
        try:
            yield process
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


def environment(**more: str) -> dict[str, str]:
    """Return an environment in which a program imports the modules of this process."""
    paths = [str(_ROOT), *filter(None, sys.path)]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), **more}


def wait_for_line(process: subprocess.Popen[str], text: str) -> str:
    """Read the output until a line contains ``text``; returns that line."""
    assert process.stdout
    for line in process.stdout:
        if text in line:
            return line
    raise AssertionError(f"{text!r} was not printed; the program ended with {process.wait(LIMIT)}")


def wait_until(condition: Callable[[], bool], what: str, limit: float = LIMIT) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + limit
    while not condition():
        assert time.monotonic() < end, f"not within {limit:g} s: {what}"
        time.sleep(0.002)
