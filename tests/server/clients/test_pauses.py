"""Pauses of several clients: each lasts until its author or the client with the lease lifts it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from bioscara import LeaseError
from bioscara.api import messages as m
from bioscara.robot import tasks
from bioscara.server.serve import Served
from served import RawClient, arm_served, events_since, eventually

AWAY = tasks.MoveJoints(positions=(0.9, 0.15, 0.2, 0.7), velocity_scaling=0.05)


@pytest.fixture(scope="module")
def arm() -> Iterator[Served]:
    with arm_served(speed=5.0) as served:
        yield served


@pytest.fixture(autouse=True)
def unpaused(arm: Served) -> Iterator[None]:
    yield
    arm.robot.stop()
    eventually(lambda: not arm.robot.is_moving)
    arm.owner.lease.end()


def paused_by(client: RawClient) -> tuple[str, ...]:
    state = client.request(m.GetState())
    assert state.paused is bool(state.paused_by)
    return tuple(state.paused_by)


def test_the_author_of_a_pause_lifts_it_without_the_lease(arm: Served) -> None:
    with RawClient("bench-script") as script, RawClient("anna") as anna:
        script.request(m.Start(task=AWAY), script.acquire())
        eventually(lambda: arm.robot.is_moving)
        anna.request(m.Pause())
        assert paused_by(anna) == ("anna",)
        anna.request(m.Resume())
        assert paused_by(anna) == ()


def test_the_motion_continues_once_no_pause_is_left(arm: Served) -> None:
    with RawClient("bench-script") as script, RawClient("anna") as anna, RawClient("ben") as ben:
        script.request(m.Start(task=AWAY), script.acquire())
        for client in (anna, ben, ben):
            client.request(m.Pause())
        eventually(lambda: not any(abs(v) > 1e-3 for v in arm.robot.state.velocities))
        here = arm.robot.state.positions
        ben.request(m.Resume())
        assert paused_by(ben) == ("anna",)
        cycle = arm.owner.sample.cycle
        eventually(lambda: arm.owner.sample.cycle > cycle + 50)
        assert arm.robot.state.positions == pytest.approx(here, abs=1e-3)
        anna.request(m.Resume())
        eventually(lambda: abs(arm.robot.state.positions[0] - here[0]) > 0.01)


def test_the_holder_of_the_lease_lifts_all_pauses(arm: Served) -> None:
    with RawClient("bench-script") as script, RawClient("anna") as anna, RawClient("ben") as ben:
        script.acquire()
        anna.request(m.Pause())
        ben.request(m.Pause())
        script.request(m.Resume())
        assert paused_by(script) == ()


def test_a_refusal_names_those_who_can_lift_the_pause(arm: Served) -> None:
    with RawClient("bench-script") as script, RawClient("anna") as anna, RawClient("ben") as ben:
        anna.request(m.Pause())
        with pytest.raises(LeaseError) as refused:
            ben.request(m.Resume())
        assert str(refused.value) == (
            "paused by 'anna'; anna can resume, or the client that takes the lease"
        )
        assert refused.value.holder == ""
        script.acquire()
        with pytest.raises(LeaseError) as refused:
            ben.request(m.Resume())
        assert str(refused.value) == (
            "paused by 'anna'; anna or the holder of the lease, 'bench-script', can resume"
        )
        assert refused.value.holder == "bench-script"
        assert paused_by(ben) == ("anna",)


def test_without_a_pause_anyone_may_resume(arm: Served) -> None:
    with RawClient("bench-script") as script, RawClient("ben") as ben:
        script.acquire()
        assert ben.request(m.Resume()) == m.Done()


def test_a_pause_stays_when_its_author_leaves(arm: Served) -> None:
    with RawClient("bench-script") as script, RawClient("ben") as ben:
        with RawClient("anna") as anna:
            anna.request(m.Pause())
        eventually(lambda: script.request(m.GetStatistics()).clients == 2)
        script.acquire()
        assert paused_by(ben) == ("anna",)
        with pytest.raises(LeaseError, match=r"paused by 'anna' \(not connected\); "):
            ben.request(m.Resume())
        # As the page of a browser that is loaded again, or the next command of a shell.
        with RawClient("anna") as again:
            again.request(m.Resume())
            assert paused_by(again) == ()


def test_a_namesake_of_a_connected_author_is_another_client(arm: Served) -> None:
    with RawClient("anna") as anna, RawClient("anna") as namesake:
        anna.request(m.Pause())
        with pytest.raises(LeaseError, match="paused by 'anna'"):
            namesake.request(m.Resume())


def test_the_events_name_who_keeps_the_arm_paused(arm: Served) -> None:
    begin = arm.owner.events.last
    with RawClient("anna") as anna, RawClient("ben") as ben:
        anna.request(m.Pause())
        ben.request(m.Pause())
        anna.request(m.Resume())
        ben.request(m.Resume())
    events = events_since(arm, begin)
    assert [event.text for event in events if event.what in {"pause", "resume"}] == [
        "anna paused all motion",
        "ben paused all motion",
        "anna lifted its pause; motion stays paused by ben",
        "ben resumed the motion",
    ]


def test_a_motion_that_begins_paused_says_who_paused(arm: Served) -> None:
    with RawClient("bench-script") as script, RawClient("anna") as anna:
        anna.request(m.Pause())
        epoch = script.acquire()
        script.request(m.Start(task=AWAY), epoch)
        assert arm.robot.warnings[-1] == (
            "move_joints() begins paused: it moves after resume() (paused by anna)"
        )
