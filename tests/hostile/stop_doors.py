"""STOP by every door while something of a served arm hangs, measured at the plant in real time.

Run by hand it prints the table of docs/server.md: PYTHONPATH=tests python -m hostile.stop_doors
"""

from __future__ import annotations

import json
import os
import pty
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from statistics import mean
from typing import Any

import httpx
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from bioscara.api import messages as m
from bioscara.errors import BioscaraError
from bioscara.remote import RemoteRobot
from bioscara.robot import tasks
from bioscara.stop import main as stop
from processes_of import members
from programs import LIMIT, environment, running, wait_for_line, wait_until
from served import NAME, RawClient, runtime_folder
from system.observed_arm import at_rest, truth
from unread import Unread, unread
from web.gateways import WebClientOfTest

ARM = Path(__file__).parents[1] / "system/observed_arm.py"
OWNER = """
import signal, sys, time
from bioscara.cli import main

# In the thread of the requests: it is that of the event loop.
signal.signal(signal.SIGUSR1, lambda *_: time.sleep(1.0))
sys.exit(main(sys.argv[1:]))
"""
ENDS = ((-1.8, 0.25, 1.0, 0.5), (1.2, 0.25, 1.0, 0.5))
SPEED = 0.1
"""Share of the largest velocity: one way takes some 40 s."""
_MOVING = 0.03
"""Speed of the first joint above which the arm moves for sure [rad/s]."""
_SLOW = 0.1
"""Time after which a speed that stays below nine tenths of the former one is a deceleration [s]."""
_AGAIN = 0.2
"""Time after which a person or program repeats a STOP that no gateway has answered [s]."""
FILES = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)


class Rig:
    """An arm in a process of its own, its owner with a gateway, and their faults.

    Attributes:
        plant: The socket of the arm, which has its true state.
        owner: The owner.
        origin: Address of the gateway, without a slash at its end.
    """

    def __init__(
        self, folder: Path, plant: Path, owner: subprocess.Popen[str], port: int, output: Unread
    ) -> None:
        self.plant, self.owner, self._output = plant, owner, output
        self.origin = f"http://127.0.0.1:{port}"
        self._folder = folder

    @property
    def token(self) -> dict[str, str]:
        """The header with the token of a viewer."""
        tokens = json.loads((self._folder / f"{NAME}.tokens").read_text())
        return {"Authorization": f"Bearer {tokens['view']}"}

    def answers(self) -> bool:
        """Return whether the owner and its gateway answer."""
        with suppress(OSError, EOFError, BioscaraError, httpx.HTTPError):
            with RawClient("look") as client:
                client.request(m.GetState())
            answer = httpx.get(f"{self.origin}/api/state", headers=self.token, timeout=1.0)
            return answer.status_code == 200
        return False

    def speed(self) -> float:
        """Return the true speed of the first joint [rad/s]."""
        return abs(truth(self.plant)[1][0])

    def mean_speed(self) -> float:
        """Return the mean of its speed, which belts swing, over 0.1 s [rad/s]."""
        return mean(self.speed() for _ in range(20))

    def begin(self, task: m.AnyTask | None = None) -> int:
        """Begin a motion that goes on without its client, or another task; return its goal."""
        with RawClient("mover") as client:
            epoch = client.acquire()
            if task is None:
                # A busy computer may have been late for the arm.
                late = client.request(m.GetFaults()).state != "clear"
                for each in (*(tasks.Acknowledge(), tasks.Recover())[: 2 * late], tasks.Enable()):
                    client.request(m.Start(task=each), epoch)
                    wait_until(lambda: not client.request(m.GetState()).moving, "it is done")
                # The farther one.
                place = max(ENDS, key=lambda end: abs(end[0] - truth(self.plant)[0][0]))
                task = tasks.MoveJoints(positions=place, velocity_scaling=SPEED)
            start = m.Start(task=task, on_lease_loss="finish")
            return int(client.request(start, epoch).goal.goal)

    def until_moving(self) -> None:
        """Wait until the first joint moves at constant speed."""
        wait_until(lambda: self.speed() > _MOVING, "the arm moves")
        former, now = 0.0, self.mean_speed()
        while abs(now - former) > 0.02 * now:
            former, now = now, self.mean_speed()

    def ended(self, goal: int) -> bool:
        """Return whether a goal was cancelled."""
        with RawClient("look") as client:
            return bool(client.request(m.GetGoal(goal)).goal.status == "cancelled")

    def send(self, name: str, number: signal.Signals) -> None:
        """Send a signal to all processes of a name."""
        found = members(self.owner, name)
        assert found, name
        for pid in found:
            os.kill(pid, number)

    def hang_gateway(self) -> None:
        """Suspend the gateway."""
        children = Path(f"/proc/{self.owner.pid}/task/{self.owner.pid}/children").read_text()
        for pid in map(int, children.split()):
            if b"\0web\0" in Path(f"/proc/{pid}/cmdline").read_bytes():
                os.kill(pid, signal.SIGSTOP)
                return
        raise AssertionError("there is no gateway")

    def limit_files(self, size: int) -> None:
        """Let no file of the owner and the process of the clients grow beyond a size."""
        for pid in (self.owner.pid, *members(self.owner, "bioscara-api")):
            resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))

    def fill_log(self) -> None:
        """Let no output of the owner be read, with a full pipe."""
        self._output.block()
        with RawClient("noisy") as client:
            for _ in range(300):
                client.request(m.Report("r" * 500))


@contextmanager
def rig(*words: str) -> Iterator[Rig]:
    """Serve an arm for a block of code.

    Args:
        *words: Further ones of the program of the arm.
    """
    with ExitStack() as stack:
        folder = stack.enter_context(runtime_folder())
        plant = folder / "arm.sock"
        options: dict[str, Any] = {"env": environment(), "cwd": folder}
        arm = stack.enter_context(running(str(ARM), str(plant), *words, **options))
        wait_for_line(arm, "listening")
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        output = stack.enter_context(unread())
        serve = ("serve", "--name", NAME, "--bus", f"sim:{plant}", "--with", f"web --port {port}")
        options |= {"stdout": output.written, "stderr": output.written}
        owner = stack.enter_context(running("-c", OWNER, *serve, cold=True, **options))
        made = Rig(folder, plant, owner, port, output)
        wait_until(made.answers, "owner and gateway answer")
        # The heartbeats have been answered once.
        time.sleep(1.0)
        yield made


# Doors: each prepares, and returns what stops.


def by_python(_: Rig, stack: ExitStack) -> Callable[[], object]:
    return stack.enter_context(RemoteRobot(NAME)).stop


def by_command(_: Rig, __: ExitStack) -> Callable[[], object]:
    return lambda: stop([NAME])


def by_http(rig: Rig, _: ExitStack) -> Callable[[], object]:
    def post() -> None:
        headers = rig.token
        while True:
            with suppress(httpx.HTTPError):
                path = f"{rig.origin}/api/stop"
                if httpx.post(path, headers=headers, timeout=1.0).status_code == 200:
                    return
            time.sleep(_AGAIN)

    return post


def by_websocket(rig: Rig, stack: ExitStack) -> Callable[[], object]:
    def opened() -> WebClientOfTest:
        address = rig.origin.replace("http", "ws", 1) + "/ws"
        connection = connect(address, additional_headers=rig.token, open_timeout=1.0)
        client = WebClientOfTest(stack.enter_context(connection))
        client.greet("page")
        return client

    client = opened()

    def send() -> None:
        nonlocal client
        while True:
            with suppress(WebSocketException, OSError, TimeoutError):
                if client.request("stop") == {"kind": "done"}:
                    return
            time.sleep(_AGAIN)
            with suppress(WebSocketException, OSError, TimeoutError):
                client = opened()

    return send


DOORS = {
    # First, as a gateway that ends again is started later.
    "HTTP": by_http,
    "WebSocket": by_websocket,
    "Python": by_python,
    "command": by_command,
}


# States.


def _nothing(_: Rig) -> None:
    return


def _kill_clients(rig: Rig) -> None:
    rig.send("bioscara-forks", signal.SIGSTOP)
    rig.send("bioscara-api", signal.SIGKILL)


STATES: dict[str, Callable[[Rig], object]] = {
    "usual": _nothing,
    "clients' process hung": lambda rig: rig.send("bioscara-api", signal.SIGSTOP),
    "gateway hung": Rig.hang_gateway,
    "nursery hung": lambda rig: rig.send("bioscara-forks", signal.SIGSTOP),
    "nursery hung, clients' process dead": _kill_clients,
    "workers hung": lambda rig: rig.send("bioscara-worker", signal.SIGSTOP),
    "event loop busy for 1 s": lambda rig: rig.owner.send_signal(signal.SIGUSR1),
    "disk full": lambda rig: rig.limit_files(0),
    "log unread": Rig.fill_log,
}
"""Faults of the processes before the STOP; the last two last."""


def measure(rig: Rig, door: str, state: str) -> float:
    """Return the time from STOP to the deceleration of the true arm, which comes to rest [s]."""
    wait_until(rig.answers, "owner and gateway answer")
    with ExitStack() as stack:
        send = DOORS[door](rig, stack)
        goal = rig.begin()
        rig.until_moving()
        STATES[state](rig)
        before = rig.mean_speed()
        assert before > _MOVING, "the arm has stopped already"
        sender, begin = threading.Thread(target=send), time.monotonic()
        sender.start()
        # The last fast moment is that before the deceleration.
        last = begin
        while time.monotonic() - last < _SLOW:
            assert time.monotonic() - begin < LIMIT
            if rig.speed() > 0.9 * before:
                last = time.monotonic()
        delay = last - begin
        wait_until(lambda: at_rest(rig.plant), "the arm is at rest")
        sender.join()
        if state == "workers hung":
            rig.send("bioscara-worker", signal.SIGCONT)
        wait_until(rig.answers, "owner and gateway answer")
        wait_until(lambda: rig.ended(goal), "the motion is cancelled")
    return delay


class Terminal:
    """``bioscara move`` in a terminal."""

    def __init__(self, rig: Rig, stack: ExitStack) -> None:
        self._near, far = pty.openpty()
        stack.callback(os.close, self._near)
        words = ("-m", "bioscara", "move", "--arm", NAME, "--joints", "0.5", "0.25", "1.0", "0.5")
        options = {"stdin": far, "stdout": far, "stderr": far, "env": environment()}
        self.program = stack.enter_context(running(*words, cold=True, **options))
        os.close(far)
        threading.Thread(target=self._read, daemon=True).start()
        rig.until_moving()

    def _read(self) -> None:
        with suppress(OSError):
            while os.read(self._near, 1 << 16):
                pass

    def interrupt(self) -> None:
        """Press Ctrl-C."""
        self.program.send_signal(signal.SIGINT)


def main() -> None:
    lines = [f"| | {' | '.join(DOORS)} |", "| --- |" + " --- |" * len(DOORS)]
    with rig("homed") as made:
        for state in STATES:
            delays = [measure(made, door, state) for door in DOORS]
            lines.append(f"| {state} | {' | '.join(f'{1e3 * each:.0f} ms' for each in delays)} |")
            sys.stderr.write(lines[-1] + "\n")
    sys.stdout.write("\n".join([*lines, ""]))


if __name__ == "__main__":
    main()
