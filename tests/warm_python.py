"""One warm process that has imported the package, and forks the programs that the tests start.

A program that is forked is a process like any other, with its own number, group, signals, files and
exit status, but begins after 5 ms instead of 300 ms of computing. Each process of the tests has one
such server, which has a single thread.
"""

from __future__ import annotations

import atexit
import builtins
import gc
import importlib
import json
import os
import pkgutil
import random
import runpy
import select
import signal
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

_TESTS = Path(__file__).parent
_PREPARED = ("cli", "server", "remote", "web", "dashboard", "recording", "report", "sim")
"""Packages of ``bioscara`` that programs import."""
_START = "import warm_python; warm_python.serve({})"
_OF_THE_INTERPRETER = ("PYTHON", "LC_", "LANG", "LD_", "MALLOC_", "OPENBLAS")
"""Beginnings of the variables that count when the interpreter starts, and not later."""
_OPTIONS = {"stdin", "stdout", "stderr", "cwd", "env", "bufsize", "text", "start_new_session"}


def can_fork(arguments: Sequence[str], options: Mapping[str, Any]) -> bool:
    """Return whether a program differs in nothing from one with an interpreter of its own.

    Args:
        arguments: Of the interpreter; with options of it, a program needs its own.
        options: Of :class:`subprocess.Popen`.
    """

    def fixed(environment: Mapping[str, str]) -> dict[str, str]:
        """Return the values that a warm process has read from its environment."""
        return {
            name: value
            for name, value in environment.items()
            if name.startswith(_OF_THE_INTERPRETER) and name != "PYTHONPATH"
        }

    plain = not arguments[0].startswith("-") or arguments[0] in {"-m", "-c"}
    env = options.get("env") or os.environ
    return plain and options.keys() <= _OPTIONS and fixed(env) == fixed(os.environ)


class Forked(subprocess.Popen[str]):
    """A program that the warm process forks; in all else a :class:`subprocess.Popen`."""

    def _execute_child(self, args: Sequence[str], *rest: Any) -> None:
        cwd, env = rest[4:6]
        pipes = rest[9:15]
        program = {
            "words": [os.fspath(word) for word in args],
            "cwd": os.fspath(cwd or os.getcwd()),
            "environment": dict(env if env is not None else os.environ),
        }
        # Of the pairs (read, write) of the three pipes the program has the first of standard input
        # and the second of the others.
        read, _, _, out, _, err = pipes
        files = [0 if read == -1 else read, 1 if out == -1 else out, 2 if err == -1 else err]
        self._ended, write = os.pipe()
        try:
            self.pid = _server().fork(program, [*files, write])
        finally:
            os.close(write)
            self._close_pipe_fds(*pipes)  # type: ignore[attr-defined]
        self._child_created = True

    def _internal_poll(self, _deadstate: int | None = None) -> int | None:
        """Look whether the program has ended."""
        with self._waitpid_lock:  # type: ignore[attr-defined]
            if self.returncode is None:
                pid, status = self._try_wait(os.WNOHANG)
                if pid:
                    self._handle_exitstatus(status)  # type: ignore[attr-defined]
        return self.returncode

    def _try_wait(self, wait_flags: int) -> tuple[int, int]:
        """Return the process with its status as waitpid(2) does, which only its parent can call."""
        ended = select.poll()
        ended.register(self._ended, select.POLLIN)
        if not ended.poll(0 if wait_flags & os.WNOHANG else None):
            return 0, 0
        status = os.read(self._ended, 4)
        os.close(self._ended)
        assert status, "the process that forks programs has ended"
        return self.pid, struct.unpack("i", status)[0]


class _Server:
    """The warm process, as seen from the process of the tests."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._channel, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        paths = [str(_TESTS), str(_TESTS.parent), *filter(None, sys.path)]
        with far:
            self._process = subprocess.Popen(
                [sys.executable, "-u", "-c", _START.format(far.fileno())],
                env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
                stdin=subprocess.DEVNULL,
                pass_fds=[far.fileno()],
                start_new_session=True,
            )
        atexit.register(self._close)

    def fork(self, program: dict[str, Any], files: list[int]) -> int:
        """Fork a program with its standard files and the pipe for its status."""
        with self._lock:
            socket.send_fds(self._channel, [json.dumps(program).encode()], files)
            answer = self._channel.recv(16)
        assert answer, "the process that forks programs has ended"
        return int(answer)

    def _close(self) -> None:
        self._channel.close()
        self._process.wait()


@cache
def _server() -> _Server:
    return _Server()


def serve(number: int) -> None:
    """Fork programs until the process of the tests has ended; in each of them, run it.

    Args:
        number: Descriptor of the socket to that process.
    """
    _prepare()
    channel = socket.socket(fileno=number)
    woken, wake = os.pipe2(os.O_NONBLOCK)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(wake)
    waiting: dict[int, int] = {}
    while True:
        ready, _, _ = select.select([number, woken], [], [])
        if woken in ready:
            os.read(woken, 4096)
            _report(waiting)
        if number not in ready:
            continue
        message, files, _, _ = socket.recv_fds(channel, 1 << 20, 4)
        if not message:
            return
        assert len(os.listdir("/proc/self/task")) == 1, "a thread would be missing in the programs"
        if (pid := os.fork()) == 0:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            _become(json.loads(message), files, channel)
            for file in (*files, *waiting.values(), woken, wake):
                os.close(file)
            _run_to_its_end(json.loads(message)["words"])
        waiting[pid] = files.pop()
        for file in files:
            os.close(file)


def _prepare() -> None:
    """Import what programs import."""
    for package in _PREPARED:
        root = importlib.import_module(f"bioscara.{package}")
        for module in pkgutil.walk_packages(root.__path__, f"bioscara.{package}."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
    for module_of_tests in ("simulated", "served", "web.gateways"):
        importlib.import_module(module_of_tests)
    gc.collect()
    # Present pages stay shared.
    gc.freeze()


def _report(waiting: dict[int, int]) -> None:
    """Report to the process of the tests which programs have ended."""
    while waiting:
        pid, status = os.waitpid(-1, os.WNOHANG)
        if not pid:
            return
        os.write(waiting[pid], struct.pack("i", status))
        os.close(waiting.pop(pid))


def _become(program: dict[str, Any], files: list[int], channel: socket.socket) -> None:
    """Become a program: as one that was started, and run it."""
    os.setsid()
    for own, file in enumerate(files[:3]):
        os.dup2(file, own)
    os.chdir(program["cwd"])
    os.environ.clear()
    os.environ.update(program["environment"])
    channel.send(str(os.getpid()).encode())
    channel.close()
    random.seed()
    if numpy := sys.modules.get("numpy"):
        numpy.random.seed()


def _run_to_its_end(words: list[str]) -> None:
    """Run a program and end this process as the interpreter does, but for freeing its memory."""
    status, interrupted = 0, False
    try:
        _run(words)
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
        if not isinstance(end.code, int | None):
            sys.stderr.write(f"{end.code}\n")
    except BaseException as error:  # noqa: BLE001  also that of Ctrl-C, as at the end of a program
        trace = error.__traceback__
        while trace and trace.tb_frame.f_code.co_filename == __file__:
            trace = trace.tb_next
        sys.excepthook(type(error), error.with_traceback(trace), trace)
        status, interrupted = 1, isinstance(error, KeyboardInterrupt)
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    sys.stdout.flush()
    if interrupted:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        signal.raise_signal(signal.SIGINT)
    os._exit(status & 0xFF)


def _run(words: list[str]) -> None:
    """Run a program as the interpreter does, in ``__main__``."""
    main = sys.modules["__main__"].__dict__
    main.clear()
    main.update(__name__="__main__", __builtins__=builtins, __spec__=None, __doc__=None)
    paths = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
    kind, *rest = words
    first = {"-m": os.getcwd(), "-c": ""}.get(kind, os.path.dirname(os.path.abspath(kind)))
    sys.path[:] = [first, *dict.fromkeys((*paths, *sys.path[1:]))]
    importlib.invalidate_caches()
    if kind == "-m":
        sys.argv[:] = ["-m", *rest[1:]]
        # One that was imported would be there twice, and runpy complains.
        sys.modules.pop(rest[0], None)
        runpy._run_module_as_main(rest[0])  # type: ignore[attr-defined]
        return
    sys.argv[:] = [kind, *rest[1:]] if kind == "-c" else words
    if kind == "-c":
        text, file = rest[0], "<string>"
    else:
        text, file = Path(kind).read_text(), kind
        main["__file__"] = file
    exec(compile(text, file, "exec"), main)
