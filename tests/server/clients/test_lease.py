"""The lease: one holder at a time, each with a higher epoch."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from bioscara.errors import InvalidArgumentError, LeaseError
from bioscara.report import CycleRecord
from bioscara.server.clients.lease import Lease


class Caller:
    """A client whose process lives until it is said to be gone."""

    connected = True

    def __init__(self, session: str, name: str = "script") -> None:
        self.session, self.name = session, name
        self.gone = False

    def send_record(self, goal: int, record: CycleRecord) -> None:
        """Take a record."""


class Time:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_only_the_holder_of_the_lease_commands() -> None:
    lease = Lease(Time())
    with pytest.raises(LeaseError, match="acquire it first"):
        lease.require("a", None)
    lease.acquire(Caller("a"), 2.0, force=False)
    lease.require("a", lease.epoch)
    with pytest.raises(LeaseError, match="script commands the arm") as refused:
        lease.require("b", lease.epoch)
    assert refused.value.holder == "script"
    with pytest.raises(LeaseError, match="script commands the arm"):
        lease.acquire(Caller("b", "browser"), 2.0, force=False)


def test_a_command_of_an_earlier_epoch_is_refused() -> None:
    lease = Lease(Time())
    lease.acquire(Caller("a"), 2.0, force=False)
    old = lease.epoch
    lease.acquire(Caller("a"), 2.0, force=False)
    with pytest.raises(LeaseError, match=f"the lease {old} of this client has ended"):
        lease.require("a", old)
    lease.require("a", lease.epoch)


def test_it_lapses_unless_it_is_renewed() -> None:
    time = Time()
    lease = Lease(time)
    lease.acquire(Caller("a"), 2.0, force=False)
    time.now += 1.5
    lease.renew()
    time.now += 1.5
    assert not lease.lapsed()
    time.now += 0.6
    assert lease.lapsed() == "the lease of script has lapsed"
    assert not lease.lapsed()
    with pytest.raises(LeaseError):
        lease.require("a", lease.epoch)


def test_it_ends_with_the_process_of_its_holder() -> None:
    lease = Lease(Time())
    caller = Caller("a")
    lease.acquire(caller, 2.0, force=False)
    assert not lease.lapsed()
    caller.gone = True
    assert lease.lapsed() == "script has ended, and its lease with it"
    lease.acquire(Caller("b"), 2.0, force=False)
    assert not lease.lapsed()


@pytest.mark.parametrize("time", [0.0, -1.0, 61.0, math.nan, math.inf])
def test_an_impossible_time_to_live_is_refused(time: float) -> None:
    lease = Lease(Time())
    with pytest.raises(InvalidArgumentError, match="time_to_live"):
        lease.acquire(Caller("a"), time, force=False)
    assert not lease.holder


@given(st.lists(st.tuples(st.sampled_from("abc"), st.booleans(), st.floats(0.0, 3.0)), max_size=30))
def test_epochs_grow_and_one_session_is_accepted(steps: list[tuple[str, bool, float]]) -> None:
    time = Time()
    lease = Lease(time)
    granted: list[tuple[str, int]] = []
    for session, force, wait in steps:
        time.now += wait
        lease.lapsed()
        try:
            lease.acquire(Caller(session), 2.0, force=force)
        except LeaseError:
            assert not force
        else:
            granted.append((session, lease.epoch))
        accepted = []
        for holder, epoch in granted:
            try:
                lease.require(holder, epoch)
            except LeaseError:
                continue
            accepted.append((holder, epoch))
        assert accepted in ([], [granted[-1]] if granted else [])
    epochs = [epoch for _, epoch in granted]
    assert epochs == sorted(set(epochs))
