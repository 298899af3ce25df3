"""Settings and fixtures of all tests. Property tests are judged by findings, not by speed."""

from __future__ import annotations

import atexit
import gc
import io
import logging
import os
import re
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from hypothesis import settings

# Before NumPy is imported: each of some 500 programs would spin for 0.1 s in a second thread.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from bioscara.robot.connection import exit_guard
from late_machine import pytest_runtest_protocol as pytest_runtest_protocol, tell_what_was_repeated
from programs import running
from ros_environment import ABSENT
from simulated import standing_near_the_stops

EXAMPLES = int(os.environ.get("BIOSCARA_EXAMPLES", "25"))
"""Number of examples of a law that does not set its own; more of them in ``make laws``."""

# Garbage is collected rarely: it takes 6 % of a run otherwise.
gc.set_threshold(50_000, 20, 50)

settings.register_profile("bioscara", deadline=None, print_blob=True, max_examples=EXAMPLES)
settings.load_profile("bioscara")

# A run in the background of a shell ignores Ctrl-C, and so would each program that a test starts.
signal.signal(signal.SIGINT, signal.default_int_handler)
# Likewise one that outlives its terminal, by nohup.
signal.signal(signal.SIGHUP, signal.SIG_DFL)


# Arms that this computer serves must not be taken for those of the tests. A short path: that of a
# socket has at most 107 bytes.
os.environ["BIOSCARA_RUNTIME"] = tempfile.mkdtemp(prefix="b")
atexit.register(shutil.rmtree, os.environ["BIOSCARA_RUNTIME"], ignore_errors=True)
os.environ.pop("BIOSCARA_ARM", None)
# Nor may they restore the load of an arm of this user.
os.environ["XDG_STATE_HOME"] = f"{os.environ['BIOSCARA_RUNTIME']}/state"


_OF_TEST_ALL = re.compile(r"^pytestmark = pytest\.mark\.(ros|browser|thorough)$", re.MULTILINE)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Skip modules that have no test of the marks that make chooses: importing all takes 10 s."""
    chosen = config.option.markexpr
    if collection_path.suffix != ".py":
        return None
    if chosen == "realtime or path":
        return not re.search(r"mark\.(realtime|path)", collection_path.read_text()) or None
    if chosen.startswith("(ros or browser)"):
        return not re.search(r"mark\.(ros|browser)", collection_path.read_text()) or None
    if chosen.startswith("thorough"):
        return "mark.thorough" not in collection_path.read_text() or None
    if chosen.startswith("not (realtime"):
        return bool(_OF_TEST_ALL.search(collection_path.read_text())) or None
    return None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Require that no test in real time is left out by the hook above."""
    for item in items:
        for mark in ("realtime", "ros", "browser", "path", "thorough"):
            if item.get_closest_marker(mark) and f"mark.{mark}" not in item.path.read_text():
                raise pytest.UsageError(f"{item.nodeid}: its module does not name the mark {mark}")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the repeated tests at the end, and once the programs that are missing."""
    tell_what_was_repeated(terminalreporter)
    path = os.environ.get("BIOSCARA_FAILED")
    if path and not hasattr(terminalreporter.config, "workerinput"):
        failed = terminalreporter.getreports("failed") + terminalreporter.getreports("error")
        with Path(path).open("a", encoding="utf-8") as file:
            for report in failed:
                crash = getattr(report.longrepr, "reprcrash", None)
                reason = str(report.longrepr) if crash is None else crash.message
                print(f"FAILED {report.nodeid}:", *reason.splitlines()[:1], file=file)
    reasons = [
        report.longrepr[2] for report in terminalreporter.getreports("skipped")
        if isinstance(report.longrepr, tuple)
    ]  # fmt: skip
    for reason in sorted({each for each in reasons if ABSENT in each}):
        terminalreporter.write_line(reason.removeprefix("Skipped: "))


def pytest_runtest_teardown() -> None:
    """Forget where a command has written its log: its standard error ends with its test."""
    root = logging.getLogger()
    for handler in [each for each in root.handlers if type(each) is logging.StreamHandler]:
        root.removeHandler(handler)
        # An owner in a thread may have begun a message, whose stream is closed with this test.
        handler.acquire()
        handler.stream = io.StringIO()
        handler.release()


def pytest_sessionfinish() -> None:
    """Forget the robots that tests left open; each would say at the exit that its bus is gone."""
    for robot in [*exit_guard._guarded]:
        exit_guard.forget(robot)


@pytest.fixture(scope="module")
def near_the_stops() -> Iterator[None]:
    """See :func:`simulated.standing_near_the_stops`; for modules in which homing is not tested."""
    with standing_near_the_stops():
        yield


@pytest.fixture
def start() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start Python programs, see :func:`programs.running`; the end of the test kills them."""
    with ExitStack() as programs:
        yield lambda *arguments, **options: programs.enter_context(running(*arguments, **options))
