"""The world around a served arm: samples of its bodies, and disturbances, by messages."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from bioscara.api import messages as m
from bioscara.api.values import placed
from bioscara.errors import (
    BioscaraError,
    InvalidArgumentError,
    LimitError,
    NotSupportedError,
)
from bioscara.remote import RemoteRobot
from bioscara.robot.simulated_world import SimulatedWorld
from bioscara.server.serve import Served
from entries import entry
from physics.served_world import world_served
from physics.worlds import FLOOR
from served import NAME, RawClient, arm_served, events_since, eventually
from unusable_values import judge


@pytest.fixture
def served() -> Iterator[Served]:
    with world_served() as made:
        yield made


def test_a_program_sees_the_bodies_and_disturbs_them_without_a_lease(served: Served) -> None:
    with RemoteRobot(NAME) as robot, RawClient() as other:
        other.acquire()
        simulation, own = robot.simulation, served.robot.simulation
        assert isinstance(simulation, SimulatedWorld)
        assert simulation.bodies == own.bodies
        assert simulation.held is None
        assert simulation.width == pytest.approx(own.width, abs=1e-5)
        for seen, there in zip(simulation.poses, own.poses, strict=True):
            assert seen.name == there.name
            assert seen[1:] == pytest.approx(there[1:], abs=1e-5)
        simulation.push("plate", (0.0, 0.0, 3.0), 0.3)
        eventually(lambda: simulation.pose("plate").z > FLOOR + 0.02)
        simulation.tilt("a", 0.002)
        eventually(
            lambda: abs(simulation.pose("a").qy) == pytest.approx(0.5 * 0.002 / 0.12776, 1e-3)
        )
        simulation.add_obstacle("crate", (0.5, 0.5, 0.0), (0.6, 0.6, 0.1))
        assert simulation.bodies[-1].name == "crate"
        assert simulation.pose("crate").x == pytest.approx(0.55)
        simulation.take_away("crate")
        assert "crate" not in [body.name for body in simulation.bodies]
    told = [each for each in events_since(served, 0) if each.what == "simulation"]
    assert [each.text.partition(" ")[2] for each in told] == [
        "pushes plate by 0, 0, 3 N for 0.3 s",
        "tilts a by 2 mm",
        "puts the obstacle crate into the world",
        "takes crate away",
    ]
    assert all(each.client for each in told)


def test_samples_have_the_bodies_that_moved_at_most_twenty_times_a_second(served: Served) -> None:
    with RawClient() as client:
        listed = client.request(m.GetBodies())
        client.request(m.Subscribe(world=True))
        samples = [client.read(m.WorldSample) for _ in range(5)]
        times = [sample.time for sample in samples]
        assert all(b - a > 0.045 for a, b in itertools.pairwise(times))
        assert {(sample.version, sample.poses) for sample in samples} == {(listed.version, ())}
        client.request(m.PushBody(name="plate", force=(0.0, 0.0, 3.0)))
        while not (sample := client.read(m.WorldSample)).poses:
            pass
        assert [pose.name for pose in sample.poses] == ["plate"]
        where = {pose.name: pose for pose in placed(listed, sample)}
        assert where["plate"] == sample.poses[0]
        assert where["a"] == listed.poses[[body.name for body in listed.bodies].index("a")]
        client.request(m.TakeAway("b"))
        while client.read(m.WorldSample).version == listed.version:
            pass
        assert len(client.request(m.GetBodies()).bodies) == len(listed.bodies) - 1
        client.request(m.Subscribe())
        eventually(lambda: not served.owner.world.wanted)


def test_a_viewer_that_confirms_nothing_gets_no_more_samples(served: Served) -> None:
    with RawClient() as client:
        client.request(m.Subscribe(world=True, unconfirmed=2))
        last = [client.read(m.WorldSample) for _ in range(2)][-1].cycle
        eventually(lambda: getattr(served.owner.world.sample, "cycle", 0) > last + 20)
        client.send(m.Received(last))
        assert client.read(m.WorldSample).cycle > last + 10


def test_disturbances_that_cannot_be_are_refused(served: Served) -> None:
    refused: dict[str, tuple[m.AnyCommand, type[BioscaraError], str]] = {
        "unknown": (m.TakeAway("plat"), InvalidArgumentError, "did you mean plate"),
        "fixed": (m.PushBody(name="a", force=(1.0, 0.0, 0.0)), InvalidArgumentError, "is fixed"),
        "strong": (m.PushBody(name="plate", force=(99.0, 0.0, 0.0)), LimitError, "force"),
        "long": (
            m.PushBody(name="plate", force=(1.0, 0.0, 0.0), duration=60.0), LimitError, "duration",
        ),
        "steep": (m.TiltBody(name="a", height=0.1), LimitError, "height"),
        "loose": (m.TiltBody(name="plate", height=0.001), InvalidArgumentError, "moves freely"),
        "taken": (
            m.AddObstacle(name="a", lower=(1.0, 1.0, 0.1), upper=(1.1, 1.1, 0.2)),
            InvalidArgumentError,
            "choose another name",
        ),
        "inside": (
            m.AddObstacle(name="crate", lower=(0.3, 0.2, 0.0), upper=(0.4, 0.3, 0.1)),
            InvalidArgumentError,
            "mm deep in",
        ),
        "named too long": (
            m.AddObstacle(name="x" * 65, lower=(1.0, 1.0, 0.1), upper=(1.1, 1.1, 0.2)),
            InvalidArgumentError,
            "1 to 64 printable characters",
        ),
        "unprintable": (
            m.AddObstacle(name="a\x1b[2J", lower=(1.0, 1.0, 0.1), upper=(1.1, 1.1, 0.2)),
            InvalidArgumentError,
            "1 to 64 printable characters",
        ),
    }  # fmt: skip
    with RawClient() as client:
        for what, (command, error, text) in refused.items():
            with entry(what), pytest.raises(error, match=text):
                client.request(command)
        with RemoteRobot(NAME) as robot, pytest.raises(NotSupportedError, match="this process"):
            robot.simulation.save()
    assert not [each for each in events_since(served, 0) if each.what == "simulation"]


def test_an_arm_without_a_world_says_so() -> None:
    with arm_served(), RawClient() as client, RemoteRobot(NAME) as robot:
        commands = (
            m.GetBodies(), m.GetWorld(), m.TakeAway("plate"),
            m.PushBody(name="plate", force=(1.0, 0.0, 0.0)), m.TiltBody(name="a", height=0.001),
            m.AddObstacle(name="crate", lower=(0.0, 0.0, 0.0), upper=(1.0, 1.0, 1.0)),
        )  # fmt: skip
        for command in commands:
            with entry(type(command).__name__), pytest.raises(NotSupportedError, match="world="):
                client.request(command)
        with pytest.raises(NotSupportedError, match="no simulated world"):
            _ = robot.simulation.held
        # It sends states to one that wants both.
        client.request(m.Subscribe(states=True, world=True))
        client.read(m.StateSample)


def test_values_that_cannot_be_are_refused_before_they_are_sent(served: Served) -> None:
    with RemoteRobot(NAME) as robot:
        simulation = robot.simulation

        def in_passing(**values: Any) -> None:
            simulation.add_obstacle(**values)
            simulation.take_away("box")

        calls: dict[str, tuple[Callable[..., object], dict[str, Any]]] = {
            "push": (
                simulation.push,
                {"name": "plate", "force": (0.0, 0.0, 0.1), "duration": 0.01},
            ),
            "tilt": (simulation.tilt, {"name": "a", "height": 0.0, "direction": 0.0}),
            "add_obstacle": (
                in_passing,
                {"name": "box", "lower": (0.7, 0.7, 0.1), "upper": (0.8, 0.8, 0.2)},
            ),
            "take_away": (simulation.take_away, {"name": "nothing"}),
            "pose": (simulation.pose, {"name": "plate"}),
        }
        for name, (call, base) in calls.items():
            assert judge(name, call, base) == []
