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
from websockets.sync.client import connect

from bioscara.api import runtime
from bioscara.api.runtime import find
from programs import LIMIT, environment, started, wait_for_line, wait_until
from web.gateways import WebClientOfTest

NAME = "hostile"
LATENCY = 0.5
"""Longest time from a STOP to the deceleration [s]: the law of 0.1 s, on a busy computer."""
MOVER_LOG = "mover.log"
GROWTH = 256 << 20
"""Memory by which a process may grow [byte]."""
LOG_MAX = 1 << 20
"""Length that a log may have, of one minute [byte]."""
PYTHON = (sys.executable, "-u")
_MOVER, _FLOOD = (Path(__file__).with_name(name) for name in ("mover.py", "flood.py"))


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
    _is_moving: bool = False
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
        """Wait until the arm moves at constant speed, and will for a while."""
        while not self._is_moving or not self._lines.empty():
            self._line()

    def stop(self, stop: Callable[[], object]) -> float:
        """Stop the arm while it moves; return the time from the call to the deceleration [s].

        Args:
            stop: Sends a STOP.
        """
        self.until_moving()
        begin = time.monotonic()
        stop()
        while not (line := self._line()).startswith("stopped"):
            pass
        decelerated = float(line.split()[1])
        assert decelerated > begin, "it decelerated before the STOP"
        return decelerated - begin

    def post_stop(self, scope: str = "view") -> None:
        """Send a STOP to the gateway over a connection of its own."""
        with httpx.Client(base_url=self.origin, timeout=LIMIT, verify=False) as client:
            answer = client.post("/api/stop", headers=self.bearer(scope))
        assert answer.status_code == 200, answer.text

    @contextmanager
    def flooded(self, kind: str, count: int = 1, scope: str = "view") -> Iterator[None]:
        """Let a hostile client of the gateway flood it for a block of code, see flood.py."""
        host, port = self.address
        words = [*PYTHON, str(_FLOOD), host, str(port), self.tokens[scope], kind, str(count)]
        with started(words, stdout=subprocess.PIPE, env=environment()) as flood:
            wait_for_line(flood, "flooding")
            yield

    def send_stop(self) -> None:
        """Send a STOP to the gateway over a new WebSocket that may only look."""
        self._ask("stop")

    def look(self) -> None:
        """Open a new WebSocket that may only look, and ask for the state."""
        self._ask("get_state")

    def _ask(self, command: str) -> None:
        with self._websocket("view") as client:
            answer = client.request(command)
            assert answer["kind"] in {"state", "done"}, answer

    @contextmanager
    def _websocket(self, scope: str) -> Iterator[WebClientOfTest]:
        with connect(
            self.origin.replace("http", "ws", 1) + "/ws",
            additional_headers=self.bearer(scope),
            compression=None,
            open_timeout=LIMIT,
        ) as socket:
            client = WebClientOfTest(socket)
            client.greet(scope)
            yield client

    def round_trips(self, seconds: float, scope: str = "operate") -> list[float]:
        """Return the times of requests on a WebSocket that follow one another, sorted [s].

        Args:
            seconds: Time to measure [s].
            scope: Scope of the token.
        """
        found = []
        with self._websocket(scope) as client:
            end = time.monotonic() + seconds
            while (begin := time.monotonic()) < end:
                client.request("get_lease")
                found.append(time.monotonic() - begin)
                time.sleep(0.01)
        return sorted(found)

    def _line(self) -> str:
        """Return the next line of the client that moves the arm."""
        try:
            line = self._lines.get(timeout=LIMIT)
        except queue.Empty:
            raise AssertionError(f"the arm did not change its motion within {LIMIT:g} s") from None
        assert not line.startswith("fault"), line
        self._is_moving = line.startswith("moving")
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
            files = {"stdout": output, "stderr": output}
            given = {"cwd": folder, "env": environment(), **files, **options}
            return stack.enter_context(started(command, **given))

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
        yield arm
        arm.check()


def _read(process: subprocess.Popen[str], lines: queue.Queue[str]) -> None:
    assert process.stdout
    for line in process.stdout:
        lines.put(line)
    lines.put(f"fault: the client that moves the arm has ended, see {MOVER_LOG}")
