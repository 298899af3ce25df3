"""The client of controllers: long trajectories, few samples, another client."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

from bioscara import Robot
from bioscara.control.controllers.joint_trajectory import (
    Goal,
    JointTrajectory,
    Point,
)
from bioscara.errors import (
    InvalidArgumentError,
    LeaseError,
    SwitchError,
)
from bioscara.remote import RemoteRobot
from client_controllers import (
    BROADCASTER,
    FORWARD,
    JOINTS,
    JTC,
    POSITION_JTC,
    Site,
    parameter_file,
    site,
)
from served import NAME, events_since, eventually


@pytest.fixture
def left() -> Iterator[Site]:
    with site() as made:
        yield made


def test_a_command_takes_less_than_a_cycle(left: Site) -> None:
    controllers = left.robot.controllers
    left.load("forward", FORWARD, {"joints": list(JOINTS), "interface_name": "position"})
    controllers.switch(["forward"])
    held, taken = left.robot.state.positions, []
    for _ in range(100):
        begin = time.perf_counter()
        controllers.command("forward", held)
        taken.append(time.perf_counter() - begin)
    assert sorted(taken)[50] < 0.01


def test_a_megabyte_of_names_is_refused_before_it_is_sent(left: Site) -> None:
    with pytest.raises(InvalidArgumentError, match="divide it"):
        left.robot.controllers.load("x", JTC, {"joints": ["j1"] * 400_000})
    with pytest.raises(InvalidArgumentError, match="divide it"):
        left.robot.controllers.switch(["name"] * 250_000)


def test_ten_thousand_points_are_followed_and_no_cycle_is_late_for_them(left: Site) -> None:
    left.activated(POSITION_JTC)
    start = left.robot.state.positions
    count = 10_000
    points = tuple(
        Point(0.5 + 5.0 * k / count, (start[0] + 0.2 * k / count, *start[1:]))
        for k in range(1, count + 1)
    )
    goal = left.robot.controllers.follow(POSITION_JTC, Goal(JointTrajectory(JOINTS, points)))
    assert left.ended(goal).status == "succeeded"
    assert left.robot.faults == ()


def test_no_end_of_a_goal_is_lost_by_a_client_that_gets_few_samples(left: Site) -> None:
    left.activated(POSITION_JTC)
    left.robot.controllers.subscribe(left.samples.append, period=5.0)
    goals = [left.follow(POSITION_JTC, (0.01, 0.0, 0.0, 0.0)) for _ in range(10)]
    left.samples.clear()
    eventually(lambda: left.samples and left.samples[-1].ended[-1:] != ())
    eventually(lambda: [each.goal for each in left.newest.ended] == goals)
    assert [each.status for each in left.newest.ended] == ["aborted"] * 9 + ["succeeded"]
    assert len(left.samples) < 20


def test_a_client_without_the_lease_can_read_and_not_change_anything(left: Site) -> None:
    left.activated(POSITION_JTC)
    with Robot.connect(f"arm:{NAME}") as other:
        assert other.controllers.list().controllers  # type: ignore[attr-defined]
        values = other.controllers.introspection()  # type: ignore[attr-defined]
        assert f"{POSITION_JTC}.stats/execution_time/average" in values.values
        assert values.diagnostics[0].name == "Controllers Activity"
        with pytest.raises(LeaseError):
            other.controllers.switch((), [POSITION_JTC])  # type: ignore[attr-defined]
    assert left.states()[POSITION_JTC] == "active"


def texts(left: Site) -> list[str]:
    """Return the texts of all events of the owner."""
    return [event.text for event in events_since(left.served, 0)]


def test_controllers_of_a_connected_client_are_its_own_and_those_of_one_that_left_are_taken(
    left: Site,
) -> None:
    forward = {"joints": list(JOINTS), "interface_name": "position"}
    with RemoteRobot(NAME) as first:
        first.controllers.load("states", BROADCASTER)
        first.controllers.load("other", FORWARD, forward)
        first.controllers.load(POSITION_JTC, **parameter_file()[POSITION_JTC])
        for name in ("states", "other", POSITION_JTC):
            first.controllers.configure(name)
        first.controllers.switch(["states"])
        first.release_lease()
        second = left.robot.controllers
        for change in (
            lambda: second.load("states", BROADCASTER),
            lambda: second.configure("other"),
            lambda: second.cleanup("other"),
            lambda: second.unload("other"),
            lambda: second.switch(["other"]),
            lambda: second.switch((), ["states"]),
            lambda: second.set_parameters(POSITION_JTC, {"gains": {}}),
        ):
            with pytest.raises(SwitchError, match=r"is that of .*which is connected; end that"):
                change()
        assert left.states()["states"] == "active"
        assert left.states()["other"] == "inactive"
    eventually(lambda: any(text.endswith(" has left") for text in texts(left)))
    second.load("states", BROADCASTER)
    assert left.states()["states"] == "unconfigured"
    second.switch(["other"])
    assert left.states()["other"] == "active"
    with pytest.raises(SwitchError, match="loaded already"):
        second.load("states", BROADCASTER)
    taken = [text for text in texts(left) if " took controller " in text]
    assert [text.partition(" took ")[2].split()[1] for text in taken] == ["states", "other"]
    assert all("which has left" in text for text in taken)
