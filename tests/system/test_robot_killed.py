"""The host of a whole arm is killed at any moment; the arm lives on in a process of its own."""

from __future__ import annotations

import math
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.system.observed_arm import truth

from bioscara.control.faults.kinds import FaultKind
from bioscara.errors import FaultedError
from bioscara.model import load_parameters
from bioscara.robot import Robot

SILENCE = 0.060
SLACK = 0.3
"""Time that a busy machine may add, and that a belt needs to swing out [s]."""
RESTING = 0.05
"""Share of its highest speed below which a joint surely rests."""
MOTOR_STEP_DEG = 1.8
JOINTS = load_parameters().joints
ROOT = Path(__file__).parents[2]


def speeds(socket: Path) -> list[float]:
    """Speeds of the joints as shares of their highest."""
    return [
        abs(speed) / joint.max_velocity
        for speed, joint in zip(truth(socket)[1], JOINTS, strict=True)
    ]


def turns(socket: Path) -> list[float]:
    """Positions of the joints at their motors [degrees]."""
    return [
        math.degrees(position * joint.reduction)
        for position, joint in zip(truth(socket)[0], JOINTS, strict=True)
    ]


def _start(folder: Path, script: str, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-u", "-m", f"tests.system.{script}", *arguments],
        stdout=subprocess.PIPE,
        text=True,
        cwd=folder,
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, sys.path)]),
            # A killed process leaves the folder of the simulated servo behind.
            "TMPDIR": str(folder),
        },
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("killed")


@pytest.fixture(scope="module")
def socket(folder: Path) -> Iterator[Path]:
    path = folder / "arm.sock"
    with _start(folder, "observed_arm", str(path), "homed") as process:
        assert process.stdout
        assert process.stdout.readline() == "listening\n"
        try:
            yield path
        finally:
            process.terminate()
            process.wait(10)
    assert process.returncode == 0


@pytest.mark.parametrize("attempt", range(3))
def test_host3_a_killed_robot_leaves_an_arm_at_rest_and_restarts_faulted_and_motionless(
    socket: Path, folder: Path, attempt: int
) -> None:
    seed = random.randrange(2**32)
    print(f"seed {seed}, attempt {attempt}")  # noqa: T201 (pytest shows it when the test fails)
    with _start(folder, "moving_robot", str(socket)) as host:
        try:
            assert host.stdout
            assert host.stdout.readline() == "moving\n"
            begin = time.monotonic()
            phase = random.Random(seed).uniform(0.2, 1.2)
            while max(speeds(socket)) < 0.2 or time.monotonic() - begin < phase:
                assert time.monotonic() - begin < 10.0, "the arm does not move"
        finally:
            host.kill()
    assert host.returncode == -signal.SIGKILL
    killed, fast = time.monotonic(), speeds(socket)
    while max(speeds(socket)) > RESTING:
        assert time.monotonic() - killed < 5.0, "the arm does not stop"
    braking = max(
        share * joint.max_velocity / joint.max_acceleration
        for share, joint in zip(fast, JOINTS, strict=True)
    )
    assert time.monotonic() - killed < SILENCE + braking + SLACK
    time.sleep(0.3)
    rest = turns(socket)
    with Robot.connect(f"sim:{socket}", evidence=folder / "again") as again:
        assert [fault.kind for fault in again.faults] == [FaultKind.SETPOINT_LOST] * len(JOINTS)
        assert [fault.source for fault in again.faults] == [joint.name for joint in JOINTS]
        with pytest.raises(FaultedError, match="SETPOINT_LOST"):
            again.enable()
        assert all(joint.is_homed() for joint in again.joints)
        assert turns(socket) == pytest.approx(rest, abs=MOTOR_STEP_DEG)
        evidence = again.acknowledge()[0].evidence
        assert evidence is not None
        assert evidence.read_text().count("SETPOINT_LOST") >= len(JOINTS)
        again.recover()
        assert again.faults == ()
    assert turns(socket) == pytest.approx(rest, abs=MOTOR_STEP_DEG)
