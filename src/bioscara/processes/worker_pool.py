"""Workers that many clients share, in turns."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from bioscara.errors import BusyOwnerError
from bioscara.processes.worker import Worker

_T = TypeVar("_T")


class WorkerPool:
    """Shares some workers among many clients, in the running event loop.

    Clients have turns: however much one asks for, another one's first request is next.

    Args:
        name: Name of their threads.
        workers: Number of them.
        memory: Memory that a call may take [MiB].
        nice: Amount by which they give way to other processes.
        each: Number of calls of one client that may wait or run.
        most: Number of those of all clients.
    """

    def __init__(
        self, name: str, workers: int, *, memory: int, nice: int, each: int, most: int
    ) -> None:
        self._workers = [Worker(memory=memory, nice=nice) for _ in range(workers)]
        self._idle = list(self._workers)
        self._threads = ThreadPoolExecutor(workers, name)
        self._each, self._most = each, most
        self._counts: dict[Hashable, int] = {}
        self._waiting: dict[Hashable, deque[asyncio.Future[Worker]]] = {}
        self._served: dict[Hashable, int] = {}
        """Number of the last turn of each client that waits or runs."""
        self._turns = 0

    def start(self) -> None:
        """Begin all processes; returns at once."""
        for worker in self._workers:
            worker.start()

    async def run(
        self, client: Hashable, timeout: float, function: Callable[..., _T], *args: Any
    ) -> _T:
        """Return the result of a function; if this is cancelled, its process ends.

        Args:
            client: The client.
            timeout: Time that it may take from its begin [s].
            function: The function, picklable as its arguments and its result.
            *args: Its arguments.

        Raises:
            BusyOwnerError: Too many calls of this client or of all wait already.
            EffortError: It took more time or memory.
            Exception: As the function does.
        """
        count = self._counts.get(client, 0)
        if count >= self._each or sum(self._counts.values()) >= self._most:
            raise BusyOwnerError(
                f"{count} requests of this client wait already, and {sum(self._counts.values())} "
                "of all; wait for the answers"
            )
        self._counts[client] = count + 1
        try:
            worker = await self._turn(client)
            begun = self._threads.submit(worker.call, timeout, function, *args)
            call = asyncio.wrap_future(begun)
            call.add_done_callback(lambda done: self._give_back(worker, done))
            try:
                return await asyncio.shield(call)
            except asyncio.CancelledError:
                if not begun.cancel():
                    worker.interrupt()
                raise
        finally:
            self._counts[client] -= 1
            if not self._counts[client]:
                del self._counts[client]
                self._served.pop(client, None)

    async def close(self) -> None:
        """End all processes, and with them the calls."""
        for worker in self._workers:
            worker.interrupt()
        for worker in self._workers:
            await asyncio.to_thread(worker.close)
        self._threads.shutdown(wait=False, cancel_futures=True)

    async def _turn(self, client: Hashable) -> Worker:
        turn: asyncio.Future[Worker] = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(client, deque()).append(turn)
        self._dispatch()
        try:
            return await turn
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled():
                self._idle.append(turn.result())
                self._dispatch()
            raise

    def _dispatch(self) -> None:
        while self._idle and self._waiting:
            client = min(self._waiting, key=lambda each: self._served.get(each, 0))
            turn = self._waiting[client].popleft()
            if not self._waiting[client]:
                del self._waiting[client]
            if not turn.done():
                self._turns += 1
                self._served[client] = self._turns
                turn.set_result(self._idle.pop())

    def _give_back(self, worker: Worker, done: asyncio.Future[Any]) -> None:
        if not done.cancelled():
            done.exception()  # taken: the one that waited may be gone
        self._idle.append(worker)
        self._dispatch()
