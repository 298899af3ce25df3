"""Calls that come at nearly the same time are one, and none gets a result that is older."""

from __future__ import annotations

import asyncio
import time

import pytest

from bioscara.web.owner.joined_calls import JoinedCalls

PERIOD = 0.05


def test_calls_of_a_period_are_one_that_begins_after_all_of_them() -> None:
    begun: list[tuple[str, set[str], float]] = []

    async def call(key: str, words: set[str]) -> int:
        begun.append((key, set(words), time.monotonic()))
        await asyncio.sleep(0.0)
        return len(begun)

    async def main() -> list[int]:
        joined = JoinedCalls(PERIOD, call)
        first = asyncio.create_task(joined.do("a", "one"))
        while not begun:
            await asyncio.sleep(0.0)
        # It has begun, and others of its key wait; another key does not.
        assert [words for _, words, _ in begun] == [{"one"}]
        others = [joined.do("a", word) for word in ("two", "three", "two")]
        return await asyncio.gather(first, *others, joined.do("b"))

    results = asyncio.run(main())
    assert [(key, words) for key, words, _ in begun] == [
        ("a", {"one"}),
        ("b", {""}),
        ("a", {"two", "three"}),
    ]
    assert results == [1, 3, 3, 3, 2]
    assert begun[2][2] - begun[0][2] > 0.9 * PERIOD


def test_each_that_is_joined_gets_the_error_and_the_next_is_carried_out() -> None:
    calls = 0

    async def call(_: None, __: set[str]) -> int:
        nonlocal calls
        calls += 1
        if calls == 1:
            raise OSError("not reachable")
        return calls

    async def main() -> None:
        joined = JoinedCalls(0.0, call)
        failed = await asyncio.gather(joined.do(None), joined.do(None), return_exceptions=True)
        assert [str(each) for each in failed] == 2 * ["not reachable"]
        assert await joined.do(None) == 2
        # One that leaves takes the result from no other.
        leaving, staying = (asyncio.create_task(joined.do(None)) for _ in range(2))
        await asyncio.sleep(0.0)
        leaving.cancel()
        assert await staying == 3
        with pytest.raises(asyncio.CancelledError):
            await leaving

    asyncio.run(main())
