"""The host is killed while a joint moves; the joints live on in a process of their own."""

from __future__ import annotations

import math
import random
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import pytest

from bioscara import Robot
from bioscara.clock import MonotonicClock
from bioscara.control.faults.kinds import FaultKind
from bioscara.drivers import Joint
from bioscara.errors import FaultedError, JointFaultError
from bioscara.model import load_parameters
from bioscara.protocol import Fault, JointState
from bioscara.sim import SocketBus
from bioscara.sim.server import _PATIENCE
from programs import environment, running, wait_for_line, wait_until
from system.observed_arm import truth

pytestmark = pytest.mark.realtime

SILENCE = 0.060
SLACK = 0.25
"""Time that a busy machine may add: the server lets its time lag behind by so much [s]."""
MOVING, RESTING = 0.3, 0.02
"""Speeds above and below which the joint surely moves and rests [rad/s]."""
J4 = load_parameters().joints[3]
MOTOR_STEP = math.radians(1.8) / abs(J4.reduction)
"""A full step of the motor, at the joint [rad]."""
HOST = Path(__file__).parent / "moving_host.py"
ARM = Path(__file__).parent / "observed_arm.py"


class Arm:
    """The arm's process, and its true state."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def position(self) -> float:
        """Position of the joint [rad]."""
        return truth(self.path)[0][3]

    def speed(self) -> float:
        """Speed of the joint [rad/s]."""
        return abs(truth(self.path)[1][3])


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Arm]:
    path = tmp_path_factory.mktemp("simulate") / "arm.sock"
    with running(str(ARM), str(path), env=environment()) as process:
        wait_for_line(process, "listening")
        yield Arm(path)
        process.terminate()
        assert process.wait(10) == 0


@contextmanager
def moving_host(arm: Arm, motion: str) -> Iterator[None]:
    """A host that begins to move the joint now; it is killed at the end of the block."""
    with running(str(HOST), str(arm.path), motion, env=environment()) as host:
        wait_for_line(host, "moving")
        yield
        host.kill()
        assert host.wait(10) == -signal.SIGKILL


@pytest.mark.parametrize("motion", ["track", "velocity"])
def test_the_joint_of_a_killed_host_stops_autonomously_and_the_next_host_gets_the_cause(
    arm: Arm, motion: str, tmp_path: Path
) -> None:
    seed = random.randrange(2**32)
    print(f"seed {seed}")  # noqa: T201 (pytest shows it when the test fails)
    phase = random.Random(seed).uniform(0.0, 1.5)
    with moving_host(arm, motion):
        begin = time.monotonic()
        while (speed := arm.speed()) < MOVING or time.monotonic() - begin < phase:
            assert time.monotonic() - begin < 10.0, "the joint does not move"
    killed = time.monotonic()
    wait_until(lambda: arm.speed() <= RESTING, "the joint stops")
    assert time.monotonic() - killed < SILENCE + speed / J4.max_acceleration + SLACK

    with SocketBus(arm.path) as bus:
        joint = Joint(bus, MonotonicClock(), J4)
        joint.init()
        assert joint.is_homed()
        # The rotor swings out before the joint reports that it is at rest.
        while (state := joint.read_state().state) is not JointState.FAULTED:
            assert state is JointState.STOPPING
        rest = arm.position()
        assert joint.get_fault().fault == Fault.SETPOINT_LOST.name
        for move in (lambda: joint.set_position(0.0), lambda: joint.set_velocity(1.0)):
            with pytest.raises(JointFaultError, match="SETPOINT_LOST"):
                move()
        with pytest.raises(JointFaultError, match="SETPOINT_LOST"):
            joint.enable()
        assert arm.position() == pytest.approx(rest, abs=MOTOR_STEP)
        assert not joint.is_enabled()
    with Robot.connect(f"sim:{arm.path}", evidence=tmp_path) as robot:
        assert isinstance(robot, Robot)
        assert [(fault.kind, fault.source) for fault in robot.faults] == [
            (FaultKind.SETPOINT_LOST, J4.name)
        ]
        with pytest.raises(FaultedError, match="SETPOINT_LOST"):
            robot.home()
        robot.acknowledge()
        robot.recover()
        assert not any(joint.is_enabled() for joint in robot.joints)
    assert arm.position() == pytest.approx(rest, abs=MOTOR_STEP)


def test_the_joint_of_a_stopped_host_stops_although_the_arm_waits_for_starved_ones(
    arm: Arm,
) -> None:
    with running(
        str(HOST), str(arm.path), "track", env=environment(), stderr=subprocess.PIPE
    ) as host:
        wait_for_line(host, "moving")
        wait_until(lambda: arm.speed() > MOVING, "the joint moves")
        speed = arm.speed()
        host.send_signal(signal.SIGSTOP)
        stopped = time.monotonic()
        wait_until(lambda: arm.speed() <= RESTING, "the joint stops")
        late = time.monotonic() - stopped
        assert late < SILENCE + speed / J4.max_acceleration + _PATIENCE + SLACK
        rest = arm.position()
        assert arm.position() == pytest.approx(rest, abs=MOTOR_STEP)
        host.send_signal(signal.SIGCONT)
        # The time for which it was stopped passed for the joint: it is no wait for a processor.
        assert host.stderr is not None
        wait_for_fault(host.stderr)


def wait_for_fault(lines: IO[str]) -> None:
    """Read until the host reports that its joint stopped autonomously."""
    for line in lines:
        if "SETPOINT_LOST" in line:
            return
    raise AssertionError("the host reported no SETPOINT_LOST")
