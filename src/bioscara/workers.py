"""Processes that do work for others: they are started before, and bounded in time and memory.

The answers to clients are computed here and not in the process that moves an arm, whose threads it
would keep waiting: Python runs one at a time, and one that decodes or plans delays a control cycle.
"""

from __future__ import annotations

import asyncio
import atexit
import gc
import importlib
import io
import os
import pickle
import resource
import select
import signal
import socket
import subprocess
import sys
import threading
import traceback
from collections import deque
from collections.abc import Callable, Hashable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from bioscara.errors import BusyOwnerError, EffortError

_T = TypeVar("_T")

_MEBIBYTE = 1 << 20
_REQUEST_MAX, _FILES_MAX = 64 << 10, 8
"""Longest request for a process [byte], and its most sockets."""
_MODULE = "bioscara.workers"
_PATIENCE = 1.0
"""Time in which it has to end once no process can ask any more [s]."""


class _Nursery:
    """The process from which others fork, once it has imported their modules.

    What forks from it begins in some milliseconds, and has nothing of the process that asks for it:
    no bus, no locked memory, and no priority if the thread that asked first had none. All processes
    that came from it share it. It ends with the last process that can ask.
    """

    def __init__(self) -> None:
        self._asking = threading.Lock()
        self._control: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._former: list[subprocess.Popen[bytes]] = []
        self._child = 0
        self._modules: tuple[str, ...] = ()
        atexit.register(self._forget)

    def adopt(self, control: socket.socket) -> None:
        """Use the nursery from which this process came."""
        # That of the process from which the nursery was copied may be taken.
        self._asking = threading.Lock()
        self._control = control

    def start(self, modules: Sequence[str] = (), *, fork: bool = False) -> None:
        """Begin to import modules; returns at once, and does nothing if that has begun already.

        Args:
            modules: Their names.
            fork: Whether the nursery is a copy of this process, which has most of the modules,
                unless that has several threads. Only for a program that has opened nothing yet.
        """
        with self._asking:
            more = [each for each in modules if each not in self._modules]
            self._modules = (*self._modules, *more)
            if more:
                self._begin(fork=fork and threading.active_count() == 1)

    def spawn(
        self, function: Callable[..., object], *args: Any, sockets: Sequence[socket.socket]
    ) -> None:
        """Let a new process call a function with sockets, which it gets, and arguments.

        Args:
            function: The function, of a module.
            *args: Its last arguments, picklable.
            sockets: Its first arguments; to be closed here.
        """
        request = pickle.dumps((function, args))
        with self._asking:
            for control in (self._started(), None):
                control = control or self._started(anew=True)  # noqa: PLW2901
                try:
                    files = [control.fileno(), *(each.fileno() for each in sockets)]
                    socket.send_fds(control, [request], files)
                except (BrokenPipeError, ConnectionError):
                    continue
                return
        raise EffortError("the process from which others fork ends at once")

    def _started(self, *, anew: bool = False) -> socket.socket:
        if self._control is None or anew:
            return self._begin(fork=False)
        return self._control

    def _begin(self, *, fork: bool) -> socket.socket:
        self._forget()
        self._control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            if fork:
                self._fork(self._control, theirs)
            else:
                self._process = self._executed(theirs)
        return self._control

    def _fork(self, ours: socket.socket, theirs: socket.socket) -> None:
        sys.stdout.flush()
        sys.stderr.flush()
        self._child = os.fork()
        if self._child == 0:
            try:
                ours.close()
                with Path(os.devnull).open("rb") as nothing:
                    os.dup2(nothing.fileno(), 0)
                _nurse(theirs, self._modules)
            finally:
                os._exit(0)

    def _executed(self, theirs: socket.socket) -> subprocess.Popen[bytes]:
        # Those that fork from it would miss the threads of BLAS.
        return subprocess.Popen(  # noqa: S603  this program
            [sys.executable, "-m", _MODULE, str(theirs.fileno()), *self._modules],
            pass_fds=[theirs.fileno()],
            env={
                **os.environ,
                "OPENBLAS_NUM_THREADS": "1",
                "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
            },
            stdin=subprocess.DEVNULL,
        )

    def _forget(self) -> None:
        """Let it end, if this process has begun it and no other one uses it."""
        if self._control is not None:
            self._control.close()
            self._control = None
        if self._process is not None:
            # Those that came from it may go on for a while, and it with them.
            self._former.append(self._process)
            self._process = None
        for process in self._former[:]:
            with suppress(subprocess.TimeoutExpired):
                process.wait(_PATIENCE)
                self._former.remove(process)
        if self._child:
            with suppress(ChildProcessError):
                os.waitpid(self._child, os.WNOHANG)
            self._child = 0


_nursery = _Nursery()
start_early, spawn = _nursery.start, _nursery.spawn


def main() -> None:
    """Be the nursery of a process that has executed this module for that."""
    _nurse(socket.socket(fileno=int(sys.argv[1])), sys.argv[2:])


def _nurse(listener: socket.socket, modules: Sequence[str]) -> None:
    """Import modules, then fork a process for each request, until no process can ask any more."""
    # Ctrl-C is for the process that asks, which then ends its workers.
    for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(each, signal.SIG_IGN)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # no process waits for them
    for module in modules:
        importlib.import_module(module)
    gc.freeze()
    while True:
        request, files, _, _ = socket.recv_fds(listener, _REQUEST_MAX, _FILES_MAX)
        if not request:
            return
        if os.fork() == 0:
            listener.close()
            _begin(request, files)
        for file in files:
            os.close(file)


def _begin(request: bytes, files: Sequence[int]) -> NoReturn:
    """Call the requested function, then end this process."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    status = 1
    try:
        control, *sockets = [socket.socket(fileno=file) for file in files]
        # That of the module: this program may have its code under another name.
        importlib.import_module(_MODULE)._nursery.adopt(control)  # noqa: SLF001
        function, args = pickle.loads(request)  # noqa: S301  of our process
        function(*sockets, *args)
        status = 0
    except BaseException:  # noqa: BLE001  the process ends, and says why
        traceback.print_exc()
    finally:
        with suppress(OSError, ValueError):
            sys.stderr.flush()
        os._exit(status)


class Worker:
    """A process that calls functions, one at a time.

    A function, its arguments and its result have to be picklable. A call that takes too long or
    is interrupted ends the process; the next call begins another one.

    Args:
        memory: Memory that a call may take [MiB].
        nice: Amount by which it gives way to other processes.
    """

    def __init__(self, *, memory: int, nice: int = 0) -> None:
        self._memory, self._nice = memory, nice
        self._calling, self._ending = threading.Lock(), threading.Lock()
        self._socket: socket.socket | None = None
        self._connection: Connection | None = None
        self._process: int | None = None
        """A descriptor of the process, as its number may be that of another one later."""
        self._closed = False

    def start(self) -> None:
        """Begin the process; a call does that too. Returns before it has imported anything."""
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
            try:
                connection = self._ready()
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
        with self._ending, suppress(OSError):
            if self._process is not None:
                signal.pidfd_send_signal(self._process, signal.SIGKILL)
            elif self._socket is not None:
                # It has not begun, and finds the connection closed.
                self._socket.shutdown(socket.SHUT_RDWR)

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
            ours, theirs = socket.socketpair()
            with theirs:
                spawn(_serve, self._memory, self._nice, sockets=[theirs])
            self._socket, self._connection = ours, Connection(os.dup(ours.fileno()))
        return self._connection

    def _ready(self) -> Connection:
        """Return the connection to the process, once that has begun."""
        if self._process is not None and select.select([self._process], [], [], 0.0)[0]:
            self._end()  # it was interrupted just after a call
        connection = self._started()
        if self._process is None:
            pid = int.from_bytes(connection.recv_bytes(), "big")
            with self._ending:
                self._process = os.pidfd_open(pid)
        return connection

    def _end(self) -> None:
        self.interrupt()
        with self._ending:
            if self._process is not None:
                os.close(self._process)
                self._process = None
            if self._socket is not None:
                self._socket.close()
                self._socket = None
        if self._connection is not None:
            self._connection.close()
            self._connection = None


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


def _serve(other: socket.socket, memory: int, nice: int) -> None:
    """Call functions until the other end is closed."""
    connection = Connection(other.detach())
    connection.send_bytes(os.getpid().to_bytes(8, "big"))
    if nice:
        os.nice(nice)
    # Where memory is short, this process is the first to end, and not the one that moves the arm.
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000")
    limit = _data_size() + memory * _MEBIBYTE
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
    while True:
        try:
            request = connection.recv_bytes()
        except (EOFError, OSError):
            return
        try:
            function, args = pickle.loads(request)  # noqa: S301  of our process
            data = _pickled((False, function(*args)))
        except MemoryError:
            text = f"it takes more than {memory} MiB of memory; ask for less at once"
            data = _pickled((True, EffortError(text)))
        except Exception as error:  # noqa: BLE001  raised where it was called
            data = _pickled((True, error))
        request = function = args = None  # type: ignore[assignment]  # not kept while it waits
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


if __name__ == "__main__":
    main()
