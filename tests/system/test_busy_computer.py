"""Every core is busy with other programs: a motion of a served arm ends, as its time waits."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from programs import environment, running, wait_for_line

pytestmark = pytest.mark.realtime

ARM = Path(__file__).parent / "observed_arm.py"
POSE = ("0.45", "-0.2", "0.25", "1.5")


@pytest.fixture
def busy() -> Iterator[None]:
    with ExitStack() as programs:
        for _ in range(os.cpu_count() or 1):
            programs.enter_context(running("-c", "while True: pass"))
        yield


@pytest.mark.usefixtures("busy")
def test_a_motion_ends_while_every_core_is_busy(tmp_path: Path) -> None:
    path = tmp_path / "arm.sock"
    with running(str(ARM), str(path), "homed", env=environment(), cwd=tmp_path) as arm:
        wait_for_line(arm, "listening")
        words = ["-m", "bioscara", "move", "--pose", *POSE, "--bus", f"sim:{path}"]
        done = subprocess.run(
            [sys.executable, *words],
            capture_output=True,
            text=True,
            check=False,
            cwd=tmp_path,
            env=environment(),
            timeout=120.0,
        )
        assert done.returncode == 0, done.stderr
