"""How the arm comes to rest when a program ends that moves it, measured at the plant in real time.

Run by hand it prints the table of docs/server.md, and with the word "https" that of docs/web.md:
OPENBLAS_NUM_THREADS=1 PYTHONPATH=tests python -m server.endings https
"""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bioscara.kinematics import Joints
from bioscara.remote.gateway import TOKEN_VARIABLE
from bioscara.robot.tasks.scope import Scope
from bioscara.server.serve import Served
from bioscara.web.access.tokens import default_path, load_tokens
from programs import environment, running, wait_for_line, wait_until
from served import HALF, NAME, arm_served
from server.ended_client import OWN
from simulated import NAMES, simulated_bus

PROGRAM = Path(__file__).with_name("ended_client.py")
INSIDE, OUTSIDE = "in a with", "outside of a with"
BY_ITSELF = ("return", "exception", "sys.exit", "os._exit")
"""Ways in which the program ends without a signal."""


class Way(NamedTuple):
    """A way to end a program.

    Attributes:
        name: Name in the table.
        kind: Argument of the program.
        number: Signal that it gets; None for a way without.
        terminal: Whether its terminal is closed.
    """

    name: str
    kind: str
    number: signal.Signals | None = None
    terminal: bool = False


WAYS = (
    *(Way(name, name) for name in BY_ITSELF),
    Way("SIGTERM", INSIDE, signal.SIGTERM),
    Way("SIGHUP", OUTSIDE, signal.SIGHUP),
    Way("SIGINT in a `with`", INSIDE, signal.SIGINT),
    Way("SIGINT outside of a `with`", OUTSIDE, signal.SIGINT),
    Way("SIGKILL", OUTSIDE, signal.SIGKILL),
    Way("closed terminal", INSIDE, terminal=True),
)


class Door(NamedTuple):
    """How a program reaches the arm.

    Attributes:
        address: Its address.
        fingerprint: That of the certificate; empty for none.
        token: The token of a gateway; empty for none.
    """

    address: str
    fingerprint: str
    token: str = ""


SOCKET = Door(*OWN)


class Ending(NamedTuple):
    """The motion of the arm when its program ended.

    Attributes:
        speed: Speed of the tool before [m/s].
        begin: Time from the end of the program to the deceleration, below 95 % of that speed [s].
        rest: Time from the end of the program to the rest [s].
        way: Way of the tool in that time [m].
    """

    speed: float
    begin: float
    rest: float
    way: float


class Plant:
    """A served arm whose true positions are recorded in real time, each cycle."""

    def __init__(self, served: Served, position: Callable[[str], float]) -> None:
        self.served = served
        self._position = position
        self._rows: list[tuple[float, ...]] = []
        runner = served.robot.runner
        runner.observers = (*runner.observers, self._record)

    def _record(self, _: object) -> None:
        self._rows.append((time.monotonic(), *map(self._position, NAMES)))

    def _tool(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the times [s] and the places of the tool [m]."""
        rows, forward = np.array(self._rows), self.served.robot.kinematics.forward
        return rows[:, 0], np.array([forward(Joints(*row))[:3] for row in rows[:, 1:]])

    def measure(self, way: Way, door: Door = SOCKET) -> Ending:
        """Let a program move the arm and end; it has ended, and the arm is at rest."""
        self._rows.clear()
        moving = self.served.robot.runner.arm.arbiter
        with _program(way, door) as (process, terminal):
            # At constant speed.
            time.sleep(0.3)
            end = _end(way, process, terminal)
            # Not awaited before: its parent may take its time.
            wait_until(lambda: not moving.running, "the arm is at rest")
            time.sleep(0.3)
            process.wait(10.0)
        return _ending(*self._tool(), end)


@contextmanager
def plant() -> Iterator[Plant]:
    """Serve an arm in real time."""
    arm = simulated_bus(seed=2, homed=True, at=HALF).arm
    with arm_served(speed=1.0, arm=arm) as served:
        yield Plant(served, arm.position)


@contextmanager
def gateway() -> Iterator[Door]:
    """Run the gateway of the arm, with TLS, on this computer."""
    words = ("-m", "bioscara", "web", "--arm", NAME, "--port", "0", "--tls-self-signed")
    with running(*words, env=environment()) as process:
        address = wait_for_line(process, "on the web: ").split("on the web: ")[1].split()[0]
        fingerprint = wait_for_line(process, "SHA-256").split()[-1]
        yield Door(address, fingerprint, load_tokens(default_path(NAME)).of(Scope.OPERATE))


@contextmanager
def _program(way: Way, door: Door) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """Run the program until the arm moves; with the near end of its terminal."""
    near, far = pty.openpty() if way.terminal else (-1, -1)
    end = os.ttyname(far) if way.terminal else ""
    words = (str(PROGRAM), way.kind, end, door.address, door.fingerprint)
    environ = environment(**{TOKEN_VARIABLE: door.token})
    options = {"env": environ, "stdin": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with running(*words, cold=way.kind in BY_ITSELF[:2], **options) as process:
        wait_for_line(process, "moving")
        if way.terminal:
            os.close(far)
        yield process, near


def _end(way: Way, process: subprocess.Popen[str], terminal: int) -> float:
    """End the program; return the time [s]."""
    if way.kind in BY_ITSELF:
        assert process.stdin
        process.stdin.write("\n")
        process.stdin.flush()
        return float(wait_for_line(process, "ending").split()[1])
    now = time.monotonic()
    if way.number is None:
        os.close(terminal)
    else:
        process.send_signal(way.number)
    return now


def _ending(times: np.ndarray, places: np.ndarray, end: float) -> Ending:
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(times)
    # Over five cycles: the times of cycles vary, as the computer does other things, too.
    speeds = np.convolve(speeds, np.ones(5) / 5.0, mode="same")
    times = times[1:]
    before = float(np.median(speeds[(times > end - 0.15) & (times <= end)]))
    # The last one: a late cycle looks slower.
    fast = times[speeds >= 0.95 * before]
    rest = times[speeds > 2e-3][-1]
    moved = (times > end) & (times <= rest)
    way = float(np.sum(np.linalg.norm(np.diff(places, axis=0), axis=1)[moved]))
    return Ending(before, max(float(fast[-1] - end), 0.0), float(rest - end), way)


def main() -> None:
    lines = ["| the program ends by | decelerates after | at rest after | way of the tool |"]
    lines.append("| --- | --- | --- | --- |")
    with plant() as arm, gateway() if "https" in sys.argv else nullcontext(SOCKET) as door:
        for way in WAYS:
            found = arm.measure(way, door)
            lines.append(
                f"| {way.name} | {1e3 * found.begin:.0f} ms | {1e3 * found.rest:.0f} ms "
                f"| {1e3 * found.way:.0f} mm |"
            )
    sys.stdout.write("\n".join([*lines, ""]))


if __name__ == "__main__":
    main()
