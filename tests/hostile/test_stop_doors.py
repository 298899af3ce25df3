"""STOP by every door in every state of a served arm: the true arm decelerates in time."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial

import pytest

from bioscara import Pose, Robot
from bioscara.api import messages as m
from bioscara.errors import OwnerLostError
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.robot import tasks
from entries import entry
from hostile.stop_doors import DOORS, STATES, Rig, Terminal, measure, rig
from programs import LIMIT, wait_until
from served import RawClient
from system.observed_arm import at_rest, truth

SOON, SECOND_WAY, RESTART = 0.5, 1.0, 20.0
"""Longest time to the deceleration on a busy computer: usually, by the second way, and beyond a
gateway that is started again [s]."""
LIMITS = {
    "usual": SOON,
    "workers hung": SOON,
    "disk full": SOON,
    "log unread": SOON,
    "nursery hung": SOON,
    "event loop busy for 1 s": SECOND_WAY,
    "clients' process hung": SECOND_WAY,
    "nursery hung, clients' process dead": SECOND_WAY,
    "gateway hung": RESTART,
}
QUICK = (("usual", "command"), ("clients' process hung", "Python"))


@pytest.fixture(scope="module")
def moving() -> Iterator[Rig]:
    with rig("homed") as made:
        yield made


@pytest.mark.parametrize(("state", "door"), QUICK)
def test_a_stop_arrives(moving: Rig, state: str, door: str) -> None:
    assert measure(moving, door, state) < LIMITS[state]


@pytest.mark.thorough
@pytest.mark.timeout(900)
def test_a_stop_arrives_by_each_door_in_each_state() -> None:
    with rig("homed") as made:
        for state in STATES:
            for door in DOORS:
                with entry(f"{state}, {door}"):
                    assert measure(made, door, state) < LIMITS[state]


@pytest.mark.thorough
@pytest.mark.timeout(300)
@pytest.mark.parametrize("state", ["usual", "clients' process hung", "event loop busy for 1 s"])
def test_ctrl_c_in_the_terminal_stops_its_own_motion(moving: Rig, state: str) -> None:
    wait_until(moving.answers, "owner and gateway answer")
    with RawClient("mover") as client:
        epoch = client.acquire()
        client.request(m.Start(task=tasks.Enable()), epoch)
        wait_until(lambda: not client.request(m.GetState()).moving, "it is enabled")
        client.request(m.ReleaseLease(), epoch)
    with ExitStack() as stack:
        terminal = Terminal(moving, stack)
        STATES[state](moving)
        terminal.interrupt()
        wait_until(lambda: at_rest(moving.plant), "the arm is at rest", LIMITS[state] + 1.0)
        terminal.program.wait(LIMIT)


def raster() -> m.AnyTask:
    """Return a motion that takes some seconds to plan."""
    points = [
        Waypoint(Pose(0.35 + 0.02 * (row % 2), -0.1 + 0.2 * row / 600, 0.25, 0.0))
        for row in range(600)
    ]
    return tasks.MoveSequence(waypoints=tuple(points))


@pytest.mark.thorough
@pytest.mark.timeout(600)
@pytest.mark.parametrize("condition", ["planning", "wait", "pause", "homing"])
def test_a_stop_ends_whatever_the_arm_does(condition: str) -> None:
    with rig(*(() if condition == "homing" else ("homed",))) as made:
        for door in DOORS:
            with entry(door), ExitStack() as stack:
                send = DOORS[door](made, stack)
                stopped_while(made, condition, send)


def stopped_while(made: Rig, condition: str, send: object) -> None:
    """Stop the arm in a condition; its goal ends, and it does not move afterwards."""
    assert callable(send)
    with RawClient("mover") as client:
        epoch = client.acquire()
        if condition != "homing":
            client.request(m.Start(task=tasks.Enable()), epoch)
            wait_until(lambda: not client.request(m.GetState()).moving, "it is enabled")
        if condition == "pause":
            client.request(m.Pause())
        given = {"planning": raster(), "wait": tasks.Wait(seconds=30.0), "homing": tasks.Home()}
        far = tasks.MoveJoints(positions=(0.5, 0.25, 1.0, 0.5), velocity_scaling=0.1)
        number = client.begin(m.Start(task=given.get(condition, far)), epoch)
        if condition == "homing":
            wait_until(lambda: not at_rest(made.plant), "it homes")
        elif condition != "planning":
            assert isinstance(client.answer(number), m.Response)
        send()
        wait_until(lambda: at_rest(made.plant), "the arm is at rest", SOON + 1.0)
        place = truth(made.plant)[0]
        if condition == "pause":
            assert not client.request(m.GetState()).paused
        wait_until(lambda: not client.request(m.GetState()).moving, "the goal has ended")
        for _ in range(20):
            assert truth(made.plant)[0] == pytest.approx(place, abs=2e-3)
        if condition == "planning" and isinstance(answer := client.answer(number), m.Response):
            # Accepted at the moment of the stop.
            assert isinstance(answer.result, m.Accepted)
            goal = m.GetGoal(answer.result.goal.goal)
            wait_until(lambda: client.request(goal).goal.status == "cancelled", "it is cancelled")


@pytest.mark.thorough
@pytest.mark.parametrize("group", [False, True], ids=["owner", "with its gateway"])
def test_a_suspended_owner_is_reported_beyond_its_gateway(moving: Rig, group: bool) -> None:
    wait_until(moving.answers, "owner and gateway answer")
    token = moving.token["Authorization"].removeprefix("Bearer ")
    suspend = partial(os.killpg if group else os.kill, moving.owner.pid)
    with Robot.connect(moving.origin, token=token) as robot:
        assert robot.state
        suspend(signal.SIGSTOP)
        try:
            time.sleep(0.5)
            begin = time.monotonic()
            with pytest.raises(OwnerLostError):
                _ = robot.state
            assert time.monotonic() - begin < 7.0
        finally:
            suspend(signal.SIGCONT)
