"""State samples: each cycle at most once, the newest, also among other messages."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from bioscara import Robot
from bioscara.api import messages as m
from bioscara.errors import InvalidArgumentError
from bioscara.sim import SimulatedArm
from served import HALF, NAME, RawClient, arm_served, eventually
from simulated import NEAR, simulated_bus


def test_each_sample_comes_once_and_events_do_not_repeat_it() -> None:
    with arm_served() as served, RawClient() as client, RawClient() as other:
        epoch = other.acquire()
        client.request(m.Subscribe(states=True, events_after=0))
        cycles = []
        for count in range(60):
            other.request(m.SetSpeedOverride(0.5 + count / 200.0), epoch)
            cycles.append(client.read(m.StateSample).cycle)
        assert all(before < after for before, after in pairwise(cycles))
        assert served.owner.events.last > 60


def test_a_period_thins_them_out() -> None:
    with arm_served() as served, RawClient() as client:
        client.request(m.Subscribe(states=True, period=0.1))
        times = [client.read(m.StateSample).time for _ in range(10)]
        assert all(after - before > 0.09 for before, after in pairwise(times))
        assert served.owner.sample.time >= times[-1]


def test_samples_of_controllers_come_to_those_who_asked_for_them_alone() -> None:
    with arm_served() as served, RawClient() as client, RawClient() as other:
        other.request(m.Subscribe(states=True))
        client.request(m.Subscribe(controllers=True, controllers_period=0.1))
        samples = [client.read(m.ControllersSample) for _ in range(5)]
        times = [sample.time for sample in samples]
        assert all(after - before > 0.09 for before, after in pairwise(times))
        assert not client.samples
        assert served.owner.controllers_wanted
        values = dict(zip(samples[-1].state_names, samples[-1].states, strict=True))
        assert values["j1/home"] > 0.0
        assert values["j3/position"] == pytest.approx(HALF[2], abs=1e-3)
        assert len(samples[-1].command_names) == len(samples[-1].commands) == 13
        with pytest.raises(InvalidArgumentError, match="must not be below zero"):
            client.request(m.Subscribe(controllers=True, controllers_period=-1.0))
        client.request(m.Subscribe())
        eventually(lambda: not served.owner.controllers_wanted)
        eventually(lambda: served.owner.controllers_sample is None)


def arrived(client: RawClient, count: int = 0) -> list[int]:
    """Return the cycles of all samples that came before an answer that follows at least so many."""
    while True:
        client.request(m.GetLease())
        if len(client.samples) >= count:
            return [sample.cycle for sample in client.samples]


def test_no_more_samples_are_sent_than_the_client_confirms() -> None:
    with arm_served() as served, RawClient() as client:
        client.request(m.Subscribe(states=True, unconfirmed=2))
        first = arrived(client, 2)
        eventually(lambda: served.owner.sample.cycle > first[-1] + 50)
        assert arrived(client) == first
        # The newest comes then, and not those between.
        before = served.owner.sample.cycle
        client.send(m.Received(cycle=first[0]))
        third = arrived(client, 3)[2:]
        # The process that answers clients may be a cycle or two behind.
        assert third[0] >= before - 2
        assert len(third) == 1
        client.send(m.Received(cycle=third[0]))
        assert len(arrived(client, 5)) == 5


def test_what_a_client_never_got_it_cannot_confirm() -> None:
    with arm_served() as served, RawClient() as client:
        client.request(m.Subscribe(states=True, unconfirmed=1))
        (first,) = arrived(client, 1)
        client.send(m.Received(cycle=first - 1))
        eventually(lambda: served.owner.sample.cycle > first + 50)
        assert arrived(client) == [first]
        # A cycle that is yet to come confirms those before, and lets no more than one follow.
        client.send(m.Received(cycle=first + 1_000_000))
        assert len(arrived(client, 2)) == 2
        eventually(lambda: served.owner.sample.cycle > client.samples[-1].cycle + 50)
        assert len(arrived(client)) == 2


def test_a_confirmation_without_a_subscription_does_nothing() -> None:
    with arm_served(), RawClient() as client:
        client.send(m.Received(cycle=1))
        client.request(m.Subscribe(states=True))
        client.send(m.Received(cycle=1))
        assert len(arrived(client, 20)) >= 20
        with pytest.raises(InvalidArgumentError, match="unconfirmed -1 must not be below zero"):
            client.request(m.Subscribe(states=True, unconfirmed=-1))


def test_a_push_is_the_load_of_its_joint_in_samples_and_history() -> None:
    # Homed by this robot: its motion leaves j1 with little load.
    arm = simulated_bus(seed=2).arm
    with (
        arm_served(arm=arm) as served,
        Robot.connect(f"arm:{NAME}") as robot,
        RawClient() as client,
    ):
        owner = served.owner
        # Until the friction of all joints holds the rest of the last motion.
        eventually(lambda: owner.sample.time > 1.0 and not owner.sample.moving)
        before = owner.sample
        assert before.loads is not None
        robot.simulate_fault("push", "j1", 1.5)
        pushed = before.loads[0] + 8.0
        eventually(lambda: (owner.sample.loads or (0.0,))[0] > pushed, what="the load of j1")
        later = owner.sample.time + 1.0
        eventually(lambda: owner.sample.time > later)
        loads = owner.sample.loads
        assert loads is not None
        assert pushed < loads[0] <= 255.0
        assert loads[1:] == pytest.approx(before.loads[1:], abs=3)
        history = client.request(m.GetHistory(begin=before.time, points=5000))
        assert isinstance(history, m.History)
        assert history.loads is not None
        assert history.loads[0][0] == before.loads[0]
        assert max(history.loads[0]) >= loads[0]
        assert max(history.loads[1]) <= before.loads[1] + 3.0
        robot.disable()
        eventually(lambda: owner.sample.loads == (0.0,) * 4, what="no load without power")


def test_the_load_of_an_original_joint_is_unknown_and_not_zero() -> None:
    arm = SimulatedArm(v1=("j2",), positions=NEAR)
    with arm_served(arm=arm) as served, RawClient() as client:
        eventually(lambda: served.owner.sample.cycle > 10)
        loads = served.owner.sample.loads
        assert loads is not None
        assert [math.isnan(load) for load in loads] == [False, True, False, False]
        history = client.request(m.GetHistory(begin=0.0, points=50))
        assert isinstance(history, m.History)
        assert history.loads is not None
        assert all(map(math.isnan, history.loads[1]))
        assert not any(map(math.isnan, history.loads[0]))
