"""Settings and fixtures of all tests. Property tests are judged by findings, not by speed."""

from __future__ import annotations

import atexit
import gc
import os
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
from late_machine import pytest_runtest_protocol as pytest_runtest_protocol
from late_machine import pytest_terminal_summary as pytest_terminal_summary
from processes import running
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
# Nor may they restore what an arm of this user carries.
os.environ["XDG_STATE_HOME"] = f"{os.environ['BIOSCARA_RUNTIME']}/state"


_OF_REALTIME = ("realtime", "realtime and not launch", "launch")
"""Choices of marks that only tests in real time have."""


def _names_realtime(module: Path) -> bool:
    """Return whether a module or the conftest beside it has the mark of tests in real time."""
    conftest = module.with_name("conftest.py")
    texts = [path.read_text() for path in (module, conftest) if path.exists()]
    return any("realtime" in text for text in texts)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Skip modules that have no test of the chosen kind: importing all of them takes 10 s."""
    chosen = config.option.markexpr
    if collection_path.suffix != ".py":
        return None
    if chosen in _OF_REALTIME and not _names_realtime(collection_path):
        return True
    if chosen == "not realtime":
        return "\npytestmark = pytest.mark.realtime\n" in collection_path.read_text() or None
    return None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Require that no test in real time is left out by the hook above."""
    for item in items:
        if item.get_closest_marker("realtime") and not _names_realtime(item.path):
            raise pytest.UsageError(f"{item.nodeid}: its module does not name the mark realtime")


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
    """Start Python programs, see :func:`processes.running`; the end of the test kills them."""
    with ExitStack() as programs:
        yield lambda *arguments, **options: programs.enter_context(running(*arguments, **options))
