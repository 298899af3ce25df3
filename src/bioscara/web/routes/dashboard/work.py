"""Work for a request that takes longer than the event loop may wait."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from http import HTTPStatus
from typing import ParamSpec, TypeVar

from bioscara.web.routes.http import HttpError

_THREADS = 2
"""Pieces of work that are done at once."""
_MOST = 16
"""Pieces of work that may wait, with those that are done."""

_P = ParamSpec("_P")
_T = TypeVar("_T")


class Work:
    """Does work in a few threads; :meth:`close` at the end."""

    def __init__(self) -> None:
        self._threads = ThreadPoolExecutor(_THREADS, "gateway-work")
        self._pending = 0

    async def do(self, function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
        """Return the result of a function.

        Raises:
            HttpError: Too much waits already.
            Exception: As the function does.
        """
        if self._pending >= _MOST:
            raise HttpError(
                HTTPStatus.SERVICE_UNAVAILABLE, "the gateway has too much to do; try again later"
            )
        loop = asyncio.get_running_loop()
        done = loop.run_in_executor(self._threads, lambda: function(*args, **kwargs))
        # Counted until it has ended, also where its client leaves.
        self._pending += 1
        done.add_done_callback(self._end)
        return await asyncio.shield(done)

    def close(self) -> None:
        """Drop what waits."""
        self._threads.shutdown(wait=False, cancel_futures=True)

    def _end(self, done: asyncio.Future[_T]) -> None:
        self._pending -= 1
        if not done.cancelled():
            # Taken, as its request may be gone: asyncio would report it.
            done.exception()
