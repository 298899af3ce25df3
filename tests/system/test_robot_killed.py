"""The host of a whole arm is killed at any moment; the arm lives on in a process of its own."""

from __future__ import annotations

import math
import random
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.control.faults.kinds import FaultKind
from bioscara.errors import FaultedError
from bioscara.model import load_parameters
from flight_records import read_record
from programs import environment, running, wait_for_line, wait_until
from system.observed_arm import at_rest, truth

pytestmark = pytest.mark.realtime

SILENCE = 0.060
SLACK = 0.3
"""Time that a busy machine may add, and that a belt needs to swing out [s]."""
RESTING = 0.05
"""Share of its highest speed below which a joint surely rests."""
MOTOR_STEP_DEG = 1.8
JOINTS = load_parameters().joints


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


def _program(
    folder: Path, script: str, *arguments: str
) -> AbstractContextManager[subprocess.Popen[str]]:
    # A killed process leaves the folder of the simulated servo behind.
    env = environment(TMPDIR=str(folder))
    return running("-m", f"tests.system.{script}", *arguments, cwd=folder, env=env)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("killed")


@pytest.fixture(scope="module")
def socket(folder: Path) -> Iterator[Path]:
    path = folder / "arm.sock"
    with _program(folder, "observed_arm", str(path), "homed") as process:
        wait_for_line(process, "listening")
        yield path
        process.terminate()
        assert process.wait(10) == 0


@pytest.mark.parametrize("attempt", range(3))
def test_host3_a_killed_robot_leaves_an_arm_at_rest_and_restarts_faulted_and_motionless(
    socket: Path, folder: Path, attempt: int
) -> None:
    seed = random.randrange(2**32)
    print(f"seed {seed}, attempt {attempt}")  # noqa: T201 (pytest shows it when the test fails)
    with _program(folder, "moving_robot", str(socket)) as host:
        wait_for_line(host, "moving")
        begin = time.monotonic()
        phase = random.Random(seed).uniform(0.2, 1.2)
        while max(speeds(socket)) < 0.2 or time.monotonic() - begin < phase:
            assert time.monotonic() - begin < 10.0, "the arm does not move"
        host.kill()
        assert host.wait(10) == -signal.SIGKILL
    killed, fast = time.monotonic(), speeds(socket)
    wait_until(lambda: max(speeds(socket)) <= RESTING, "the arm stops")
    braking = max(
        share * joint.max_velocity / joint.max_acceleration
        for share, joint in zip(fast, JOINTS, strict=True)
    )
    assert time.monotonic() - killed < SILENCE + braking + SLACK
    wait_until(lambda: at_rest(socket), "the belts swing out")
    rest = turns(socket)
    with Robot.connect(f"sim:{socket}", evidence=folder / "again") as again:
        assert isinstance(again, Robot)
        assert [fault.kind for fault in again.faults] == [FaultKind.SETPOINT_LOST] * len(JOINTS)
        assert [fault.source for fault in again.faults] == [joint.name for joint in JOINTS]
        with pytest.raises(FaultedError, match="SETPOINT_LOST"):
            again.enable()
        assert all(joint.is_homed() for joint in again.joints)
        assert turns(socket) == pytest.approx(rest, abs=MOTOR_STEP_DEG)
        evidence = again.acknowledge()[0].evidence
        faults = read_record(evidence).faults
        assert sum("SETPOINT_LOST" in fault for fault in faults) >= len(JOINTS)
        again.recover()
        assert again.faults == ()
    assert turns(socket) == pytest.approx(rest, abs=MOTOR_STEP_DEG)
