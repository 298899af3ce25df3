"""However a program ends, the arm that it moves comes to rest at once, and the next may begin."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace

import pytest

from bioscara.errors import BusyError, LeaseError, NotInitializedError
from bioscara.remote import RemoteRobot, remote_robot
from programs import environment, wait_for_line
from served import NAME, events_since, eventually
from server.endings import PROGRAM, WAYS, Door, Plant, Way, gateway, plant

Start = Callable[..., subprocess.Popen[str]]
USUAL = ("return", "os._exit", "SIGKILL")
"""Ways that differ most; the others are tried beyond a gateway now and then."""


@pytest.fixture(scope="module")
def arm() -> Iterator[Plant]:
    with plant() as served:
        yield served


@pytest.mark.realtime
@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.name)
def test_the_arm_decelerates_within_100_ms_however_its_program_ends(arm: Plant, way: Way) -> None:
    ending = arm.measure(way)
    assert ending.speed > 0.2
    assert ending.begin < 0.1, ending
    assert ending.way < 0.06, ending
    robot = arm.served.robot
    assert (robot.faults, robot.is_enabled) == ((), True)
    assert not arm.served.owner.lease.holder


@pytest.fixture(scope="module")
def https(arm: Plant) -> Iterator[Door]:
    assert arm.served.robot.is_homed
    with gateway() as door:
        yield door


@pytest.mark.realtime
@pytest.mark.parametrize(
    "way",
    [way if way.name in USUAL else pytest.param(way, marks=pytest.mark.thorough) for way in WAYS],
    ids=lambda way: way.name,
)
def test_the_arm_decelerates_within_500_ms_however_its_program_beyond_the_gateway_ends(
    arm: Plant, https: Door, way: Way
) -> None:
    ending = arm.measure(way, https)
    assert ending.speed > 0.2
    assert ending.begin < 0.5, ending
    assert ending.way < 0.16, ending
    assert not arm.served.owner.lease.holder


def moving(
    start: Start, kind: str = "outside of a with", *, cold: bool = False
) -> subprocess.Popen[str]:
    options = {"env": environment(), "stdin": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    process = start(str(PROGRAM), kind, "", cold=cold, **options)
    wait_for_line(process, "moving")
    return process


def kill(process: subprocess.Popen[str]) -> None:
    """Kill a cold program, and return when it is dead and its parent has not awaited it."""
    process.kill()
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)


def test_the_next_program_begins_at_once_and_its_first_command_waits_for_the_rest(
    start: Start, arm: Plant
) -> None:
    with RemoteRobot(NAME) as robot:
        process = moving(start, cold=True)
        with pytest.raises(LeaseError, match=str(process.pid)):
            robot.acquire_lease(timeout=0.1)
        kill(process)
        here = arm.served.robot.state.positions
        assert arm.served.robot.is_moving
        robot.move_joints(here)
        end = robot.state.positions
        assert end == pytest.approx(here, abs=5e-3)


def test_a_program_waits_for_the_lease_of_another_one(start: Start, arm: Plant) -> None:
    with RemoteRobot(NAME) as robot:
        process = moving(start, "return")
        assert process.stdin
        process.stdin.write("\n")
        process.stdin.flush()
        robot.acquire_lease(timeout=20.0)
        robot.move_joints(robot.state.positions)
        assert arm.served.owner.lease.holder


def test_who_waits_for_the_lease_does_not_get_it_by_a_stop(
    start: Start, arm: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    with RemoteRobot(NAME) as robot, RemoteRobot(NAME) as person:
        moving(start)
        # Between two attempts.
        waits = SimpleNamespace(monotonic=time.monotonic, sleep=lambda _: person.stop())
        monkeypatch.setattr(remote_robot, "time", waits)
        with pytest.raises(
            LeaseError, match="stopped while this program waited for the lease; acq"
        ):
            robot.acquire_lease(timeout=20.0)
        assert not arm.served.owner.lease.holder
        robot.acquire_lease()


FINISHING = """
import sys
from bioscara.api import messages as m
from bioscara.robot import tasks
from served import RawClient

with RawClient("finishing") as client:
    epoch = client.acquire()
    task = tasks.MoveJoints(positions=tuple(map(float, sys.argv[1:])), velocity_scaling=0.05)
    client.request(m.Start(task=task, on_lease_loss="finish"), epoch)
    print("begun", flush=True)
    sys.stdin.readline()
"""


def test_a_goal_that_may_finish_is_not_stopped_and_not_waited_for(start: Start, arm: Plant) -> None:
    first, *others = arm.served.robot.state.positions
    goal = map(str, (0.0 if abs(first) > 0.5 else 0.8, *others))
    program = start("-c", FINISHING, *goal, cold=True, env=environment(), stdin=subprocess.PIPE)
    wait_for_line(program, "begun")
    kill(program)
    with RemoteRobot(NAME) as robot:
        begin = time.monotonic()
        with pytest.raises(BusyError):
            robot.move_joints(robot.state.positions)
        assert time.monotonic() - begin < 5.0
        assert arm.served.owner.goals.running
        robot.stop()
        eventually(lambda: not robot.is_moving)


FORKING = """
import os, signal, sys, time
from bioscara import BioscaraError, Robot
from served import NAME

signal.alarm(20)
robot = Robot.connect(f"arm:{NAME}").open()
first, *others = robot.state.positions
motion = robot.move_joints(
    (-1.2 if first > 0.0 else 1.2, *others), velocity_scaling=0.2, wait=False
)
if os.fork() == 0:
    signal.alarm(10)
    calls = [
        lambda: robot.state, robot.stop, robot.home, robot.open, robot.acquire_lease, motion.wait,
        motion.cancel, robot.gripper.open, lambda: robot.is_moving, robot.shutdown, motion.pause,
    ]
    for call in calls:
        try:
            call()
        except BioscaraError as error:
            # In one piece: the parent writes a line at the same time.
            print(f"{type(error).__name__} {error}\\n", end="", flush=True)
    with robot if sys.argv[1] == "with" else open("/dev/null"):
        pass
    print("child", flush=True)
    if sys.argv[1] == "lives":
        time.sleep(60.0)
    sys.exit()
if sys.argv[1] != "lives":
    os.wait()
print(f"forked {motion.done}\\n", end="", flush=True)
time.sleep(60.0)
"""


@pytest.mark.parametrize("how", ["with", "lives"])
def test_a_forked_child_does_nothing_to_the_arm_of_its_parent(
    start: Start, arm: Plant, how: str
) -> None:
    program = start("-c", FORKING, how, cold=True, env=environment())
    for _ in range(11):
        line = wait_for_line(program, NotInitializedError.__name__)
        assert f"belongs to process {program.pid}, from which this one was forked" in line
    wait_for_line(program, "child" if how == "lives" else "forked False")
    # Neither the end of the child, nor its end of the block, has stopped the motion.
    goals = arm.served.owner.goals
    assert goals.running
    assert arm.served.owner.lease.holder
    kill(program)
    # Also while the child lives.
    eventually(lambda: not goals.running, 1.0, "the arm is at rest")


def test_the_end_of_a_program_is_told_apart_from_its_silence(start: Start, arm: Plant) -> None:
    last = arm.served.owner.events.last
    program = moving(start, cold=True)
    kill(program)
    eventually(lambda: not arm.served.owner.goals.running, 1.0)
    texts = [event.text for event in events_since(arm.served, last)]
    assert any(f"[{program.pid}] has ended, and its lease with it" in text for text in texts)
