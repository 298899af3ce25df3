"""A second program is refused while one moves the arm, and the motion continues."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from bioscara.bus import Transaction
from bioscara.cli.output.console import ExitStatus
from bioscara.errors import BusUnavailableError
from bioscara.sim import SocketBus
from programs import environment, wait_for_line, wait_until
from system.observed_arm import truth

HERE = Path(__file__).parent
PING = Transaction(0x14, b"\x0f", 2)


def test_a_motion_runs_through_while_other_programs_try_to_connect(
    start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    path = tmp_path / "arm.sock"
    wait_for_line(start(str(HERE / "observed_arm.py"), str(path), env=environment()), "listening")
    host = start(
        str(HERE / "moving_host.py"),
        str(path),
        "track",
        cold=True,
        env=environment(),
        stderr=subprocess.PIPE,
    )
    wait_for_line(host, "moving")
    used = f"used by moving_host.py (pid {host.pid}): two programs"
    for _ in range(20):
        with SocketBus(path) as bus, pytest.raises(BusUnavailableError) as caught:
            bus.transfer([PING])
        assert used in str(caught.value)
    before = truth(path)[0][3]
    joints = start(
        *("-m", "bioscara", "joints", "--bus", f"sim:{path}"),
        env=environment(),
        stderr=subprocess.PIPE,
    )
    said, complaint = joints.communicate(timeout=20.0)
    assert joints.returncode == ExitStatus.REFUSED
    assert said == f"arm: simulation, in the process behind {path}\n"
    assert used in complaint
    # It swings: where the other program ended, it may be where it was before.
    wait_until(lambda: abs(truth(path)[0][3] - before) > 0.01, "the joint goes on")
    host.kill()
    rest, errors = host.communicate(timeout=20.0)
    # After a stop, as by a silence of 60 ms, it would have complained and begun anew.
    assert (rest, errors) == ("", "")
