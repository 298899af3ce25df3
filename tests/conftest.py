"""Settings and fixtures of all tests. Property tests are judged by findings, not by speed."""

from __future__ import annotations

import atexit
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest
from hypothesis import settings

from late_machine import pytest_runtest_protocol as pytest_runtest_protocol
from late_machine import pytest_terminal_summary as pytest_terminal_summary
from processes import running
from simulated import standing_near_the_stops

EXAMPLES = int(os.environ.get("BIOSCARA_EXAMPLES", "25"))
"""Number of examples of a law that does not set its own; more of them in ``make laws``."""

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
