"""A simulated arm that moves all the time, served with its gateway by processes, to be attacked.

:func:`moving_arm` starts ``bioscara serve``, ``bioscara web`` and a client that moves the arm to
and fro. A test attacks owner or gateway in its block and measures STOP by
:meth:`MovingArm.stop`; at the end the arm must have no fault, and neither process may have grown
or written much.
"""

from __future__ import annotations

import json
import queue
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx

from bioscara.api import runtime
from bioscara.api.runtime import find
from processes import LIMIT, environment, started, wait_until

NAME = "hostile"
LATENCY = 0.5
"""Longest time from a STOP to the deceleration [s]: the law of 0.1 s, on a busy computer."""
MOVER_LOG = "mover.log"
GROWTH = 256 << 20
"""Memory by which a process may grow [byte]."""
LOG_MAX = 1 << 20
"""Length that a log may have, of one minute [byte]."""
PYTHON = (sys.executable, "-u")
_MOVER = Path(__file__).with_name("mover.py")


@dataclass
class MovingArm:
    """The processes, and how they are reached.

    Attributes:
        folder: Their working directory, with the logs ``serve.log`` and ``web.log``.
        owner: The process of ``bioscara serve``.
        gateway: That of ``bioscara web``; None without.
        origin: Address of the gateway, without a slash at its end.
        tokens: Token of each scope, by ``view``, ``operate`` and ``admin``.
    """

    folder: Path
    owner: subprocess.Popen[str]
    gateway: subprocess.Popen[str] | None = None
    origin: str = ""
    tokens: dict[str, str] = field(default_factory=dict)
    _lines: queue.Queue[str] = field(default_factory=queue.Queue)
    _memory: dict[int, int] = field(default_factory=dict)
    _begin: float = field(default_factory=time.monotonic)

    @property
    def socket(self) -> Path:
        """The owner's socket."""
        return find(NAME).socket

    @property
    def address(self) -> tuple[str, int]:
        """Host and port of the gateway."""
        host, _, port = self.origin.partition("://")[2].rpartition(":")
        return host, int(port)

    def bearer(self, scope: str) -> dict[str, str]:
        """Return the headers of a program with the token of a scope."""
        return {"Authorization": f"Bearer {self.tokens[scope]}"}

    def until_moving(self) -> None:
        """Wait until the arm moves at constant speed."""
        self._line("moving")

    def stop(self, stop: Callable[[], object]) -> float:
        """Stop the arm while it moves; return the time from the call to the deceleration [s].

        Args:
            stop: Sends a STOP.
        """
        self.until_moving()
        begin = time.monotonic()
        stop()
        while (decelerated := float(self._line("stopped").split()[1])) < begin:
            pass
        return decelerated - begin

    def post_stop(self, scope: str = "view") -> None:
        """Send a STOP to the gateway over a connection of its own."""
        with httpx.Client(base_url=self.origin, timeout=LIMIT, verify=False) as client:
            answer = client.post("/api/stop", headers=self.bearer(scope))
        assert answer.status_code == 200, answer.text

    def _line(self, word: str) -> str:
        end = time.monotonic() + LIMIT
        while True:
            try:
                line = self._lines.get(timeout=max(end - time.monotonic(), 0.01))
            except queue.Empty:
                raise AssertionError(f"the arm is not {word} within {LIMIT:g} s") from None
            assert not line.startswith("fault"), line
            if line.startswith(word):
                return line

    def begin_check(self) -> None:
        """Remember the memory of the processes."""
        for process in (self.owner, self.gateway):
            if process is not None:
                self._memory[process.pid] = memory_of(process.pid)

    def check(self) -> None:
        """Require that the processes run and have neither grown nor written much."""
        for process, log in ((self.owner, "serve.log"), (self.gateway, "web.log")):
            if process is None:
                continue
            text = (self.folder / log).read_text()
            assert process.poll() is None, text[-2000:]
            assert memory_of(process.pid) - self._memory[process.pid] < GROWTH, log
            minutes = max((time.monotonic() - self._begin) / 60.0, 1.0)
            assert len(text) < LOG_MAX * minutes, f"{log}: {len(text)} bytes: {text[-2000:]}"
        faults = flight_records(self.folder)
        assert faults == [], faults


def flight_records(folder: Path) -> list[Path]:
    """Return the flight records that the owner has written: it writes one for each fault."""
    return sorted((folder / "faults").glob("*.mcap"))


def memory_of(pid: int) -> int:
    """Return the resident memory of a process and its children [byte]."""
    status = Path(f"/proc/{pid}/status").read_text()
    found = re.search(r"VmRSS:\s+(\d+)", status)
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return 1024 * int(found[1] if found else 0) + sum(map(memory_of, map(int, children)))


@contextmanager
def moving_arm(folder: Path, *words: str, web: bool = True, **options: Any) -> Iterator[MovingArm]:
    """Serve an arm that moves, and its gateway, for a block of code; check them at its end.

    Args:
        folder: Working directory of the processes, an empty one.
        *words: Further words of ``bioscara web``.
        web: Whether there is a gateway.
        **options: Of :class:`subprocess.Popen`, for owner and gateway.
    """
    with ExitStack() as stack:

        def bioscara(log: str, *arguments: str) -> subprocess.Popen[str]:
            output = stack.enter_context((folder / log).open("w"))
            command = [*PYTHON, "-m", "bioscara", *arguments]
            given = {"cwd": folder, "env": environment(), **options}
            return stack.enter_context(started(command, stdout=output, stderr=output, **given))

        def wait_for(log: str, pattern: str, process: subprocess.Popen[str]) -> re.Match[str]:
            path = folder / log
            wait_until(
                lambda: bool(re.search(pattern, path.read_text())) or process.poll() is not None,
                f"{log} has {pattern}",
            )
            found = re.search(pattern, path.read_text())
            assert found, path.read_text()
            return found

        owner = bioscara("serve.log", "serve", "--name", NAME, "--homed", "--seed", "1")
        wait_for("serve.log", f"{NAME} is served", owner)
        arm = MovingArm(folder, owner)
        if web:
            arm.gateway = bioscara("web.log", "web", "--arm", NAME, "--port", "0", *words)
            origin = wait_for("web.log", r"on the web: (https?://\S+)/", arm.gateway)[1]
            arm.origin = origin
            tokens = (runtime.folder() / f"{NAME}.tokens").read_text()
            arm.tokens = json.loads(tokens)
        mover = stack.enter_context(
            started(
                [*PYTHON, str(_MOVER), NAME],
                stdout=subprocess.PIPE,
                stderr=stack.enter_context((folder / MOVER_LOG).open("w")),
                cwd=folder,
                env=environment(),
            )
        )
        reader = threading.Thread(target=_read, args=(mover, arm._lines), daemon=True)
        reader.start()
        arm.begin_check()
        arm.until_moving()
        arm._lines.put("moving")
        yield arm
        arm.check()


def _read(process: subprocess.Popen[str], lines: queue.Queue[str]) -> None:
    assert process.stdout
    for line in process.stdout:
        lines.put(line)
    lines.put(f"fault: the client that moves the arm has ended, see {MOVER_LOG}")
