"""Work for a request that takes longer than the event loop may wait, in processes of its own.

In threads it would delay each message that passes between a browser and the owner.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from functools import partial
from http import HTTPStatus
from typing import Any, ParamSpec, TypeVar

from fastapi import Request

from bioscara.processes.nursery import start_early, supervise
from bioscara.processes.worker_pool import WorkerPool
from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.guard import Credential, requester
from bioscara.web.routes.http import HttpError

MODULES = (
    "bioscara.dashboard.clearance",
    "bioscara.dashboard.model",
    "bioscara.dashboard.parameters",
    "bioscara.dashboard.recordings",
    "bioscara.dashboard.sequences",
    "bioscara.dashboard.trajectories",
    "bioscara.web.routes.http",
)
"""Modules that a process has imported before it begins."""
_MEMORY, _TIMEOUT, _NICE = 1024, 30.0, 5
"""Memory [MiB] and time [s] of one piece of work, and how much it gives way to the owner."""
_EACH, _MOST = 6, 24
"""Pieces of work of a client that may wait, with those that are done, and of all."""

_log = logging.getLogger(__name__)
_P = ParamSpec("_P")
_T = TypeVar("_T")


class Work:
    """Does work in a few processes; :meth:`close` at the end.

    Clients that may only look have a process of their own, and keep no operator waiting.
    """

    def __init__(self) -> None:
        start_early(MODULES)
        self._pools = {
            views: WorkerPool(name, 1, memory=_MEMORY, nice=_NICE, each=_EACH, most=_MOST)
            for views, name in ((True, "viewers"), (False, "operators"))
        }
        self._supervising: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin the processes; the first work does that too."""
        for pool in self._pools.values():
            pool.start()
        loop = asyncio.get_running_loop()
        self._supervising = loop.create_task(supervise(partial(_log.warning, "%s")))

    async def do(
        self, request: Request, function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs
    ) -> _T:
        """Return the result of a function; it ends if its client leaves.

        Args:
            request: The request, whose body has come.
            function: The function, picklable as its arguments and its result.
            *args: Its arguments.
            **kwargs: Likewise.

        Raises:
            BioscaraError: Too much waits already, or it took too long.
            HttpError: The client has left.
            Exception: As the function does.
        """
        credential: Credential = request.state.credential
        pool = self._pools[credential.scope == Scope.VIEW]
        client = requester(credential, credential.address)
        loop = asyncio.get_running_loop()
        working = loop.create_task(pool.run(client, _TIMEOUT, partial(function, *args, **kwargs)))
        leaving = loop.create_task(_left(request))
        try:
            await asyncio.wait((working, leaving), return_when=asyncio.FIRST_COMPLETED)
            if working.done():
                return working.result()
            raise HttpError(HTTPStatus.REQUEST_TIMEOUT, "the client has left")
        finally:
            for task in (working, leaving):
                task.cancel()
            await asyncio.gather(working, leaving, return_exceptions=True)

    async def close(self) -> None:
        """End the processes, and what they do."""
        if self._supervising is not None:
            self._supervising.cancel()
        for pool in self._pools.values():
            await pool.close()


async def _left(request: Request) -> None:
    """Wait until a client has left."""
    message: Any = {}
    while message.get("type") != "http.disconnect":
        message = await request.receive()
