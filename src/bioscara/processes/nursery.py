"""The process from which the processes of a program fork, as quickly as they are needed."""

from __future__ import annotations

import asyncio
import atexit
import gc
import importlib
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, NoReturn

from bioscara.errors import EffortError
from bioscara.processes.scheduling import name_process
from bioscara.processes.supervision import Heartbeat, until_lost

_REQUEST_MAX, _FILES_MAX = 64 << 10, 8
"""Longest request for a process [byte], and its most sockets."""
_MODULE = "bioscara.processes.nursery"
_PATIENCE = 1.0
"""Time in which it has to end once no process can ask any more [s]."""
_POLL = 0.02
"""Period of the look for an answer [s]."""
_QUESTION = b"?"
"""Request to close the socket that comes with it: an answer."""


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
        """Use the nursery of another process from now on."""
        # That of the process from which the nursery was copied may be taken.
        self._asking = threading.Lock()
        self._disconnect()
        self._control = control

    @property
    def control(self) -> socket.socket | None:
        """The socket by which a process that is given it can :meth:`adopt` this nursery."""
        return self._control

    async def supervise(
        self, report: Callable[[str], object], replaced: Callable[[], object] = lambda: None
    ) -> None:
        """Begin another nursery whenever the one that this process has begun hangs or ends.

        Args:
            report: Called with what happened, in words.
            replaced: Called when there is another one.
        """
        what = "the process from which others fork"
        while True:
            with ExitStack() as questions:
                heartbeat = Heartbeat(
                    self._pid,
                    lambda: self._ask(questions, heartbeat.answer),  # noqa: B023
                )
                hangs = await until_lost(
                    heartbeat, lambda: report(f"{what} does not answer, as it gets no processor")
                )
            with self._asking:
                if heartbeat.pid == self._pid:
                    report(f"{what} {'hangs' if hangs else 'has ended'}, and is started again")
                    self._kill()
                    self._begin(fork=False)
            replaced()

    @property
    def _pid(self) -> int:
        return self._process.pid if self._process is not None else self._child

    def _kill(self) -> None:
        if pid := self._pid:  # 0 would be this process, with all of its group
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        if self._child:
            with suppress(ChildProcessError):
                os.waitpid(self._child, 0)
            self._child = 0

    async def until_answered(self) -> None:
        """Return when the nursery takes requests; :meth:`supervise` replaces one that hangs."""
        answered, pid = asyncio.Event(), 0
        with ExitStack() as questions:
            while not answered.is_set():
                if pid != self._pid:
                    pid = self._pid
                    self._ask(questions, answered.set)
                await asyncio.sleep(_POLL)

    def _ask(self, questions: ExitStack, answer: Callable[[], object]) -> None:
        """Send a question; call ``answer`` when it is answered.

        Args:
            questions: Closes its sockets at the end.
            answer: The function.
        """
        loop, (ours, theirs) = asyncio.get_running_loop(), socket.socketpair()

        def answered() -> None:
            questions.close()
            answer()

        questions.callback(ours.close)
        with theirs, suppress(OSError):
            assert self._control is not None  # noqa: S101  it has begun
            _send(self._control, _QUESTION, [theirs.fileno()])
            loop.add_reader(ours, answered)
            questions.callback(loop.remove_reader, ours)

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
                    _send(control, request, [each.fileno() for each in (control, *sockets)])
                except ConnectionError:
                    continue
                except BlockingIOError:
                    break
                return
        raise EffortError("the process from which others fork takes no request")

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
        # A fork copies one thread only: with threads of BLAS, its children would wait for them.
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
        self._disconnect()
        for process in self._former[:]:
            with suppress(subprocess.TimeoutExpired):
                process.wait(_PATIENCE)
                self._former.remove(process)
        if self._child:
            with suppress(ChildProcessError):
                os.waitpid(self._child, os.WNOHANG)
            self._child = 0

    def _disconnect(self) -> None:
        if self._control is not None:
            self._control.close()
            self._control = None
        if self._process is not None:
            # Its children may run on for a while, and it ends after them.
            self._former.append(self._process)
            self._process = None


_nursery = _Nursery()
start_early, spawn = _nursery.start, _nursery.spawn
supervise, until_answered = _nursery.supervise, _nursery.until_answered


def hand_over(to: socket.socket, word: bytes) -> None:
    """Send the nursery with a word to a process, which may :func:`adopt` it."""
    if _nursery.control is not None:
        socket.send_fds(to, [word], [_nursery.control.fileno()])


def adopt(file: int) -> None:
    """Use the nursery that was handed over from now on.

    Args:
        file: The file that has come.
    """
    _nursery.adopt(socket.socket(fileno=file))


def _send(control: socket.socket, request: bytes, files: Sequence[int]) -> None:
    """Send a request; raises BlockingIOError where the nursery has not taken those before it."""
    socket.send_fds(control, [request], files, socket.MSG_DONTWAIT)


def main() -> None:
    """Be the nursery of a process that has executed this module for that."""
    _nurse(socket.socket(fileno=int(sys.argv[1])), sys.argv[2:])


def _nurse(listener: socket.socket, modules: Sequence[str]) -> None:
    """Import modules, then fork a process for each request, until no process can ask any more."""
    name_process("bioscara-forks")
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
        if request != _QUESTION and os.fork() == 0:
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


if __name__ == "__main__":
    main()
