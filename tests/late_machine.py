"""Tests in real time: one that fails while the computer ran late says so and is repeated.

In real time are those that start programs, serve an arm, or have threads. Several processes run
tests at a time. A repetition is the only one that runs;
from the second on, it begins once the computer is in time.
"""

from __future__ import annotations

import fcntl
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from types import FunctionType, TracebackType
from typing import Self

import pytest
from _pytest.runner import runtestprotocol

REPEATED = "repeated"
"""Section of a report that says why."""
MARKS = ("realtime", "ros", "browser")
HELPERS = {"processes", "served", "web.gateways"}
"""Modules whose names a module of tests in real time has."""
TICK = 0.005
LATE = 0.01
"""Lateness of a thread [s] that means a late computer: a cycle of the control loop."""
REPETITIONS = int(os.environ.get("BIOSCARA_REPETITIONS", "3"))
PATIENCE, QUIET = 60.0, 0.5
"""Time to wait for a computer that is in time, and time for which it has to be [s]."""


class LatenessMonitor:
    """Measures how much later than requested the operating system wakes up a thread on each core.

    A process that a test started may be late while the process of the tests is not.
    """

    def __init__(self) -> None:
        self.worst = 0.0
        self._ended = threading.Event()
        self._threads = [
            threading.Thread(target=self._run, args=(core,), name="lateness", daemon=True)
            for core in os.sched_getaffinity(0)
        ]

    def _run(self, core: int) -> None:
        os.sched_setaffinity(0, {core})  # of this thread alone
        while not self._ended.is_set():
            begin = time.monotonic()
            if self._ended.wait(TICK):
                return
            self.worst = max(self.worst, time.monotonic() - begin - TICK)

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._ended.set()
        for thread in self._threads:
            thread.join()


@contextmanager
def running(*, alone: bool) -> Iterator[None]:
    """Run a test together with those of other processes, or once theirs have ended.

    The lock of this file is shared by the tests that run. That of its folder is a turnstile: while
    one waits to run alone, no other begins.
    """
    turnstile = os.open(Path(__file__).parent, os.O_RDONLY)
    room = os.open(__file__, os.O_RDONLY)
    try:
        fcntl.flock(turnstile, fcntl.LOCK_EX)
        fcntl.flock(room, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        if not alone:
            fcntl.flock(turnstile, fcntl.LOCK_UN)
        yield
    finally:
        for lock in (room, turnstile):
            # Closing alone would not do it where a process that was forked has a copy.
            fcntl.flock(lock, fcntl.LOCK_UN)
            os.close(lock)


def in_real_time(item: pytest.Item) -> bool:
    """Return whether a test depends on how fast the computer is at other things."""
    if any(item.get_closest_marker(mark) for mark in MARKS):
        return True
    if not isinstance(item, pytest.Function):
        return False
    fixtures = item._fixtureinfo.name2fixturedefs.values()
    functions = (item.function, *(known[-1].func for known in fixtures))
    return "start" in item.fixturenames or any(
        _names_helper(function.__module__)
        for function in functions
        if function.__module__ not in {"conftest", "tests.conftest"}
    )


@cache
def _names_helper(module: str) -> bool:
    """Return whether a module of tests or fixtures has a name of one of the helpers."""
    names = vars(sys.modules[module]).values() if module in sys.modules else ()
    return any(
        each is threading or (isinstance(each, FunctionType | type) and each.__module__ in HELPERS)
        for each in names
    )


def wait_while_late() -> None:
    """Wait until the computer is in time for a while, or PATIENCE has passed."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        with LatenessMonitor() as machine:
            time.sleep(QUIET)
        if machine.worst <= LATE:
            return


def _why_again(item: pytest.Item, reports: list[pytest.TestReport], late: float) -> str:
    """Return why a test is repeated; empty if it passed, or the computer was in time."""
    failed = [report.longreprtext for report in reports if report.failed]
    # How late a browser draws is not seen from here.
    unseen = "tests/dashboard/" in item.nodeid or any("OVERRUN" in text for text in failed)
    if not failed or (late <= LATE and not unseen):
        return ""
    errors = [line for line in failed[0].splitlines() if line.startswith("E ")]
    why = f"{item.nodeid}: the computer was {1e3 * late:.0f} ms late; once more"
    return "\n".join([why, *errors[:3]])


def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    """Run a test in real time; if it fails on a late machine, repeat it on fresh fixtures."""
    if not in_real_time(item):
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    with running(alone=False), LatenessMonitor() as machine:
        reports = runtestprotocol(item, log=False, nextitem=nextitem)
    told: list[str] = []
    while len(told) < REPETITIONS and (text := _why_again(item, reports, machine.worst)):
        told.append(text)
        # Fixtures of the module, such as a process with an arm, may have failed.
        with suppress(Exception):
            # Those that complain at their end have done so in the first run.
            item.session._setupstate.teardown_exact(None)
        item._initrequest()  # type: ignore[attr-defined]
        with running(alone=True):
            if len(told) > 1:
                wait_while_late()
            with LatenessMonitor() as machine:
                reports = runtestprotocol(item, log=False, nextitem=nextitem)
    if told:
        for report in reports:
            report.sections.append((REPEATED, "\n".join(told)))
    for report in reports:
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


def tell_what_was_repeated(terminalreporter: pytest.TerminalReporter) -> None:
    """Name the tests that passed when they were repeated."""
    for report in terminalreporter.getreports("passed"):
        for title, text in report.sections:
            if title == REPEATED and report.when == "call":
                terminalreporter.write_line(text)
