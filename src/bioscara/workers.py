"""Processes that do work for others: they are started before, and bounded in time and memory.

What a client asks for is computed here and not in the process that moves an arm, whose threads it
would keep waiting: Python runs one at a time, and one that decodes or plans delays a control cycle.
"""

from __future__ import annotations

import asyncio
import io
import multiprocessing
import os
import pickle
import resource
import signal
import threading
from collections import deque
from collections.abc import Callable, Hashable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext, ForkServerProcess
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from bioscara.errors import BusyOwnerError, EffortError

_P = ParamSpec("_P")
_T = TypeVar("_T")

_MEBIBYTE = 1 << 20
_PATIENCE = 1.0
"""Time in which a process that was killed has to end [s]."""


def forking_early(modules: Sequence[str] = ()) -> ForkServerContext:
    """Return the context of processes that fork from one which has imported modules already.

    Such a process begins in some milliseconds. It has nothing of the process that asks for it: no
    bus, no locked memory, and no priority if the thread that asks first has none.

    Args:
        modules: Names of the modules; only those of the first call in a process count.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__, *modules])
    return context


class Worker:
    """A process that calls functions, one at a time.

    A function, its arguments and its result have to be picklable. A call that takes too long or
    is interrupted ends the process; the next call begins another one.

    Args:
        name: What it does, for the list of the processes.
        memory: Memory that a call may take [MiB].
        nice: Amount by which it gives way to other processes.
    """

    def __init__(self, name: str, *, memory: int, nice: int = 0) -> None:
        self._name, self._memory, self._nice = name, memory, nice
        self._calling = threading.Lock()
        self._process: ForkServerProcess | None = None
        self._connection: Connection | None = None
        self._closed = False

    @property
    def pid(self) -> int | None:
        """Number of the process; None before the first call, and between two processes."""
        return None if self._process is None else self._process.pid

    def start(self) -> None:
        """Begin the process; a call does that too."""
        with self._calling:
            self._started()

    def call(self, timeout: float, function: Callable[..., _T], *args: Any) -> _T:
        """Return the result of a function; called by any thread, one call at a time.

        Args:
            timeout: Time that it may take [s].
            function: The function.
            *args: Its arguments.

        Raises:
            EffortError: It took more time or memory, or was interrupted.
            Exception: As the function does.
        """
        with self._calling:
            connection = self._started()
            try:
                connection.send_bytes(_pickled((function, args)))
                if not connection.poll(timeout):
                    raise EffortError(f"it takes longer than {timeout:g} s; ask for less at once")
                raised, value = pickle.loads(connection.recv_bytes())  # noqa: S301  of our process
            except (EOFError, OSError):
                self._end()
                raise EffortError("the process that computed it has ended; ask for less") from None
            except EffortError:
                self._end()
                raise
        if raised:
            raise value
        result: _T = value
        return result

    def interrupt(self) -> None:
        """End the call that runs, if one does; from any thread."""
        if (process := self._process) is not None:
            with suppress(OSError, ValueError):
                process.kill()

    def close(self) -> None:
        """End the process, also in a call; none can begin any more."""
        self._closed = True
        self.interrupt()
        with self._calling:
            self._end()

    def _started(self) -> Connection:
        if self._connection is None:
            if self._closed:
                raise EffortError("the process that computes is closed")
            context = forking_early()
            self._connection, theirs = context.Pipe()
            self._process = context.Process(
                target=_serve,
                args=(theirs, self._memory, self._nice),
                name=self._name,
                daemon=True,
            )
            self._process.start()
            theirs.close()
        return self._connection

    def _end(self) -> None:
        process, connection = self._process, self._connection
        self._process = self._connection = None
        if connection is not None:
            connection.close()
        if process is not None:
            process.kill()
            process.join(_PATIENCE)
            process.close()


class WorkerPool:
    """Shares some workers among many clients, in the running event loop.

    Clients have turns: however much one asks for, another one's first request is next.

    Args:
        name: What they do.
        workers: Number of them.
        memory: Memory that a call may take [MiB].
        nice: Amount by which they give way to other processes.
        each: Number of calls of one client that may wait or run.
        most: Number of those of all clients.
    """

    def __init__(
        self, name: str, workers: int, *, memory: int, nice: int, each: int, most: int
    ) -> None:
        self._workers = [Worker(name, memory=memory, nice=nice) for _ in range(workers)]
        self._idle = list(self._workers)
        self._threads = ThreadPoolExecutor(workers, name)
        self._each, self._most = each, most
        self._counts: dict[Hashable, int] = {}
        self._waiting: dict[Hashable, deque[asyncio.Future[Worker]]] = {}
        self._served: dict[Hashable, int] = {}
        """Number of the last turn of each client that waits or runs."""
        self._turns = 0

    def start(self) -> None:
        """Begin all processes; takes as long as their imports."""
        for worker in self._workers:
            worker.start()

    async def run(
        self, client: Hashable, timeout: float, function: Callable[..., _T], *args: Any
    ) -> _T:
        """Return the result of a function; if this is cancelled, its process ends.

        Args:
            client: Who asks.
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
            loop = asyncio.get_running_loop()
            call = loop.run_in_executor(self._threads, worker.call, timeout, function, *args)
            call.add_done_callback(lambda done: self._give_back(worker, done))
            try:
                return await asyncio.shield(call)
            except asyncio.CancelledError:
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


class _Pickler(pickle.Pickler):
    """Pickles errors by their attributes: the arguments of their constructors are not kept."""

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, BaseException):
            return _error, (type(value), value.args, dict(vars(value)))
        return NotImplemented


def _error(kind: type[BaseException], args: tuple[Any, ...], values: dict[str, Any]) -> Any:
    error = kind.__new__(kind)
    error.args = args
    vars(error).update(values)
    return error


def _pickled(value: object) -> bytes:
    stream = io.BytesIO()
    _Pickler(stream, pickle.HIGHEST_PROTOCOL).dump(value)
    return stream.getvalue()


def _serve(connection: Connection, memory: int, nice: int) -> None:
    """Call functions until the other end is closed."""
    # Ctrl-C is for the process that asks, which then ends this one.
    for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(each, signal.SIG_IGN)
    if nice:
        os.nice(nice)
    limit = _data_size() + memory * _MEBIBYTE
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
    while True:
        try:
            function, args = pickle.loads(connection.recv_bytes())  # noqa: S301  of our process
        except (EOFError, OSError):
            return
        answer: tuple[bool, Any]
        try:
            answer = False, function(*args)
            data = _pickled(answer)
        except MemoryError:
            text = f"it takes more than {memory} MiB of memory; ask for less at once"
            data = _pickled((True, EffortError(text)))
        except Exception as error:  # noqa: BLE001  raised where it was called
            data = _pickled((True, error))
        answer = function = args = None  # type: ignore[assignment]  # not kept while it waits
        try:
            connection.send_bytes(data)
        except OSError:
            return


def _data_size() -> int:
    """Return the memory that this process has for data now [byte]."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmData:"):
            return 1024 * int(line.split()[1])
    return 0
