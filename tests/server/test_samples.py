"""State samples: each cycle once, the newest, whatever else is sent."""

from __future__ import annotations

from itertools import pairwise

import pytest

from bioscara.api import messages as m
from bioscara.errors import InvalidArgumentError
from served import HALF, RawClient, arm_served, eventually


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
