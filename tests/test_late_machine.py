"""A test in real time that fails on a late machine is repeated alone, and is named."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import late_machine

CONFTEST = """
import late_machine
from late_machine import pytest_runtest_protocol
from late_machine import tell_what_was_repeated as pytest_terminal_summary

late_machine.LATE = -1.0
late_machine.PATIENCE = 0.0
"""
TESTS = """
import time
from pathlib import Path

import pytest


@pytest.mark.realtime
@pytest.mark.parametrize("number", range(8))
def test_it(number):
    running, failed = Path("running"), Path(f"failed-{number}")
    running.mkdir(exist_ok=True)
    own = running / str(number)
    own.touch()
    time.sleep(0.05)
    beside = len(list(running.iterdir())) - 1
    own.unlink()
    if number % 3 == 0 and not failed.exists():
        failed.touch()
        raise ValueError("the first time")
    if failed.exists():
        assert beside == 0
    assert number != 7
"""


def test_a_test_that_failed_is_repeated_alone_and_named(tmp_path: Path) -> None:
    shutil.copy(late_machine.__file__, tmp_path)
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "test_in_real_time.py").write_text(TESTS)
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = realtime: in real time\n")
    command = (sys.executable, "-m", "pytest", "-n", "3", "-p", "no:cacheprovider")
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "1 failed, 7 passed" in ended.stdout, ended.stdout
    named = re.findall(r"test_it\[(\d)\]: the computer was \d+ ms late; once more", ended.stdout)
    # Each as often as it failed; the last one always does.
    assert sorted(set(named)) == ["0", "3", "6", "7"]
    assert named.count("7") == late_machine.REPETITIONS
    assert "ValueError: the first time" in ended.stdout
