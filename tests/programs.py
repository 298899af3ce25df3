"""Programs that a test starts; each ends with the test, with all processes that it started.

They also end where the process of the tests is killed: a reaper, a process of its own, sees that.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from warm_python import Forked, can_fork

LIMIT = 40.0
"""Time after which a condition counts as never met [s]; programs sleep for longer."""
_ROOT = Path(__file__).parents[1]
_REAPER = """
import os, signal, sys
groups = set()
for line in sys.stdin:
    (groups.add if line[0] == "+" else groups.discard)(int(line[1:]))
for group in groups:
    try:
        os.killpg(group, signal.SIGKILL)
    except ProcessLookupError:
        pass
"""


@cache
def _reaper() -> subprocess.Popen[str]:
    """Start the process that kills groups of processes once this one has ended."""
    words = [sys.executable, "-I", "-S", "-c", _REAPER]
    return subprocess.Popen(
        words, stdin=subprocess.PIPE, text=True, bufsize=1, start_new_session=True
    )


@contextmanager
def started(command: Sequence[str], **options: object) -> Iterator[subprocess.Popen[str]]:
    """Run a program in a process group of its own, which is killed at the end of the block.

    Args:
        command: The program and its arguments.
        **options: Of :class:`subprocess.Popen`.
    """
    with _ended_with_the_tests(
        subprocess.Popen(command, text=True, start_new_session=True, **options)  # type: ignore[call-overload]
    ) as process:
        yield process


@contextmanager
def _ended_with_the_tests(program: subprocess.Popen[str]) -> Iterator[subprocess.Popen[str]]:
    groups = _reaper().stdin
    assert groups
    with program as process:
        groups.write(f"+{process.pid}\n")
        try:
            yield process
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            groups.write(f"-{process.pid}\n")


@contextmanager
def running(
    *arguments: str, cold: bool = False, **options: object
) -> Iterator[subprocess.Popen[str]]:
    """Run a Python program as :func:`started` does, forked from a process that is warm.

    Args:
        *arguments: Of the interpreter: ``"-m", "bioscara", "demo"``.
        cold: Whether the program needs an interpreter of its own, which starts with it.
        **options: Of :class:`subprocess.Popen`; by default standard output is a pipe.
    """
    options = {"stdout": subprocess.PIPE, **options}
    if cold or not can_fork(arguments, options):
        with started([sys.executable, "-u", *arguments], **options) as process:
            yield process
        return
    forked = Forked(arguments, text=True, start_new_session=True, **options)  # type: ignore[call-overload]
    with _ended_with_the_tests(forked) as process:
        yield process


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
