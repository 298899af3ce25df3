"""STOPs of clients: each one stops the arm, and repetitions of a client are one event."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bioscara import MotionCancelledError
from bioscara.api import messages as m
from bioscara.cli import main
from bioscara.robot import tasks
from bioscara.server.serve import Served
from programs import LIMIT, environment, wait_for_line
from served import HALF, NAME, RawClient, arm_served, events_since, eventually, runtime_folder

AWAY = tasks.MoveJoints(positions=(0.9, 0.15, 0.2, 0.7), velocity_scaling=0.05)


@pytest.fixture(scope="module")
def arm() -> Iterator[Served]:
    with arm_served(speed=5.0) as served:
        yield served


@pytest.fixture
def stops(arm: Served) -> Callable[[], list[str]]:
    """Return the function that returns the clients of the stops since the test began."""
    begin = arm.owner.events.last
    return lambda: [each.client for each in events_since(arm, begin) if each.what == "stop"]


def test_a_stop_that_its_client_repeats_is_one_event(
    arm: Served, stops: Callable[[], list[str]]
) -> None:
    with RawClient("one") as one, RawClient("two") as two:
        for client in (one, one, two, two, one):
            client.request(m.StopAll())
        assert stops() == ["one", "two"]


def test_a_repeated_stop_stops_what_began_since_and_is_another_event(
    arm: Served, stops: Callable[[], list[str]]
) -> None:
    with RawClient("one") as one:
        epoch = one.acquire()
        for _ in range(3):
            begun = one.request(m.Start(task=AWAY), epoch)
            eventually(lambda: arm.robot.is_moving)
            for _ in range(5):
                one.request(m.StopAll())
            ended = arm.owner.goals.get(begun.goal.goal).operation
            assert ended.wait(10.0)
            assert isinstance(ended.error, MotionCancelledError)
        assert stops() == ["one"] * 3
        one.request(m.Pause())
        one.request(m.StopAll())
        assert stops() == ["one"] * 4
        one.request(m.ReleaseLease(), epoch)


def test_a_repeated_stop_ends_the_lease_that_another_client_took_since(
    arm: Served, stops: Callable[[], list[str]]
) -> None:
    with RawClient("one") as one, RawClient("two") as two:
        one.request(m.StopAll())
        two.acquire()
        one.request(m.StopAll())
        assert not arm.owner.lease.holder
        assert stops() == ["one"] * 2


def taken_by_a_client() -> None:
    with RawClient("two") as two:
        epoch = two.acquire(force=True)
        two.request(m.ReleaseLease(), epoch)


def taken_by_a_command() -> None:
    assert main(["lease", "--end", "--arm", NAME]) == 0


@pytest.mark.parametrize("take", [taken_by_a_client, taken_by_a_command])
@pytest.mark.parametrize("on_loss", ["stop", "finish"])
def test_taking_the_lease_from_another_client_stops_its_motion(
    arm: Served, take: Callable[[], None], on_loss: m.OnLeaseLoss
) -> None:
    arm.robot.move_joints(HALF)
    with RawClient("one") as one:
        goal = one.request(m.Start(task=AWAY, on_lease_loss=on_loss), one.acquire()).goal.goal
        eventually(lambda: arm.robot.is_moving)
        take()
        one.request(m.Subscribe(events_after=arm.owner.events.last - 20))
        ended = one.event("goal_ended", goal=goal)
        assert ended.goal is not None
        assert ended.goal.status == "cancelled"
        eventually(lambda: not arm.robot.is_moving)


def test_a_motion_that_may_finish_goes_on_when_its_client_releases_the_lease(arm: Served) -> None:
    arm.robot.move_joints(HALF)
    with RawClient("one") as one, RawClient("two") as two:
        epoch = one.acquire()
        task = tasks.MoveJoints(positions=AWAY.positions, velocity_scaling=0.5)
        goal = one.request(m.Start(task=task, on_lease_loss="finish"), epoch).goal.goal
        one.request(m.ReleaseLease(), epoch)
        # Nor does the next commander end it: it takes the lease from no other client.
        two.request(m.ReleaseLease(), two.acquire(force=True))
        operation = arm.owner.goals.get(goal).operation
        assert operation.wait(LIMIT)
        operation.result()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_to_a_command_is_one_stop(
    number: int, start: Callable[..., subprocess.Popen[str]], tmp_path: Path
) -> None:
    with runtime_folder():
        words = ("-m", "bioscara", "serve", "--name", NAME, "--table", str(tmp_path / "poses.yaml"))
        owner = start(*words, env=environment())
        wait_for_line(owner, "is served")
        with RawClient("look") as look:
            command = ("-m", "bioscara", "home", "--arm", NAME)
            mover = start(*command, env=environment(), stderr=subprocess.PIPE)
            look.request(m.Subscribe(events_after=0))
            look.event("goal_accepted")
            # From here on it takes a signal as the request to stop.
            wait_for_line(mover, "homing")
            mover.send_signal(number)
            ended = look.event("goal_ended")
            _, said = mover.communicate(timeout=20.0)
            assert ended.goal is not None
            assert (ended.goal.status, mover.returncode) == ("cancelled", 130), said
            while not any("has left" in event.text for event in look.events):
                look.read(m.Event)
            assert [event.client for event in look.events if event.what == "stop"] == [ended.client]
