"""A process that computes for others, bounded in time and memory.

The answers to clients are computed so and not in the process that moves an arm, whose threads they
would keep waiting: Python runs one at a time, and one that decodes or plans delays a control cycle.
"""

from __future__ import annotations

import io
import os
import pickle
import resource
import select
import signal
import socket
import struct
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

from bioscara.errors import EffortError
from bioscara.processes.nursery import spawn
from bioscara.processes.scheduling import name_process

_T = TypeVar("_T")

_MEBIBYTE = 1 << 20


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
                connection = self._ready(timeout)
                connection.send_bytes(_pickled((function, args)))
                raised, value = pickle.loads(self._received(timeout))  # noqa: S301  of our process
            except BlockingIOError:
                self._end()
                raise _too_long(timeout) from None
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

    def _ready(self, timeout: float) -> Connection:
        """Return the connection to the process, once that has begun."""
        if self._process is not None and select.select([self._process], [], [], 0.0)[0]:
            self._end()  # it was interrupted just after a call
        connection = self._started()
        # A process that is suspended takes and sends only a part of a message.
        limit = struct.pack("@ll", int(timeout), int(timeout % 1.0 * 1e6))
        for option in (socket.SO_SNDTIMEO, socket.SO_RCVTIMEO):
            assert self._socket is not None  # noqa: S101  it has started
            self._socket.setsockopt(socket.SOL_SOCKET, option, limit)
        if self._process is None:
            pid = int.from_bytes(self._received(timeout), "big")
            with self._ending:
                self._process = os.pidfd_open(pid)
        return connection

    def _received(self, timeout: float) -> bytes:
        assert self._connection is not None  # noqa: S101  it has started
        if not self._connection.poll(timeout):
            raise _too_long(timeout)
        return self._connection.recv_bytes()

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


def _too_long(timeout: float) -> EffortError:
    return EffortError(f"it takes longer than {timeout:g} s; ask for less at once")


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
    name_process("bioscara-worker")
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
