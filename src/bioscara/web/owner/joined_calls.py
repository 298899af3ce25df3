"""Calls that are carried out as one where they come at nearly the same time."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable, Hashable
from typing import Generic, TypeVar

_Key = TypeVar("_Key", bound=Hashable)
_Result = TypeVar("_Result")


class JoinedCalls(Generic[_Key, _Result]):
    """Carries calls out: the first at once, those of its key in the period after it as one.

    All that are joined get the same result or error. It is never older than any of them, as none
    joins one that has begun.

    Args:
        period: Least time between the begins of two calls of a key [s].
        call: Carries out the calls of a key, with the words of all that are joined.
    """

    def __init__(self, period: float, call: Callable[[_Key, set[str]], Awaitable[_Result]]) -> None:
        self._period, self._call = period, call
        self._waiting: dict[_Key, tuple[set[str], asyncio.Task[_Result]]] = {}
        self._begun: dict[_Key, float] = {}

    async def do(self, key: _Key, word: str = "") -> _Result:
        """Return the result of a call.

        Args:
            key: Calls with another key are not joined with it.
            word: Passed on, with those of the others.
        """
        if key not in self._waiting:
            words: set[str] = set()
            task = asyncio.get_running_loop().create_task(self._carry_out(key, words))
            # Each that waits may have left when it ends.
            task.add_done_callback(lambda done: done.cancelled() or done.exception())
            self._waiting[key] = words, task
        words, task = self._waiting[key]
        words.add(word)
        return await asyncio.shield(task)

    async def _carry_out(self, key: _Key, words: set[str]) -> _Result:
        loop = asyncio.get_running_loop()
        await asyncio.sleep(self._begun.get(key, -math.inf) + self._period - loop.time())
        now = loop.time()
        self._begun = {each: at for each, at in self._begun.items() if at > now - self._period}
        self._begun[key] = now
        del self._waiting[key]
        return await self._call(key, words)
