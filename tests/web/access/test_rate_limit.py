"""Limits of rates, on a clock of the test."""

from __future__ import annotations

from bioscara.web.access.rate_limit import RateLimit, RateLimits


class Clock:
    def __init__(self) -> None:
        self.time = 100.0

    def __call__(self) -> float:
        return self.time


def test_so_much_at_once_and_so_much_per_second_later() -> None:
    clock = Clock()
    limit = RateLimit(5, 0.5, clock)
    assert [limit.take() for _ in range(6)] == [True] * 5 + [False]
    clock.time += 1.9
    assert not limit.take()
    clock.time += 0.1
    assert limit.take()
    assert not limit.take()
    clock.time += 3600.0
    assert [limit.take() for _ in range(6)] == [True] * 5 + [False]


def test_a_larger_message_costs_more() -> None:
    limit = RateLimit(10, 1, Clock())
    assert limit.take(9.0)
    assert not limit.take(1.5)
    assert limit.take(1.0)


def test_each_client_has_its_own_limit_and_few_are_remembered() -> None:
    clock = Clock()
    limits = RateLimits(1, 0.1, most=3, clock=clock)
    assert limits.take("a")
    assert not limits.take("a")
    assert limits.take("b")
    assert len(limits._limits) == 2
    for number in range(10):
        limits.take(str(number))
    assert len(limits._limits) == 3
