"""State samples: each cycle once, the newest, whatever else is sent."""

from __future__ import annotations

from itertools import pairwise

from bioscara.api import messages as m
from served import RawClient, arm_served


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
