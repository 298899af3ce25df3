"""STOP by every door while something of a served arm hangs, measured at the plant in real time."""

from __future__ import annotations

import json
import os
import pty
import resource
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from pathlib import Path
from statistics import mean
from typing import Any, NamedTuple

import httpx
import numpy as np
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
_BEGIN = 15.0
"""Time in which a motion has begun, also that of a command that is started [s]."""
_BEFORE = 0.15
"""Time before the STOP in which the former speed is measured [s]."""
_AGAIN = 0.2
"""Time after which a person or program repeats a STOP that no gateway has answered [s]."""
_IN_TERMINAL = """
import fcntl, sys, termios
from bioscara.cli import main

fcntl.ioctl(0, termios.TIOCSCTTY, 0)
sys.exit(main(sys.argv[1:]))
"""
"""A command whose terminal sends it the signal of a key."""


class Rig:
    """An arm in a process of its own, its owner with a gateway, and their faults.

    Attributes:
        folder: The runtime folder.
        plant: The socket of the arm, which has its true state.
        owner: The owner.
        origin: Address of the gateway, without a slash at its end.
    """

    def __init__(
        self, folder: Path, plant: Path, owner: subprocess.Popen[str], port: int, output: Unread
    ) -> None:
        self.plant, self.owner, self._output = plant, owner, output
        self.origin = f"http://127.0.0.1:{port}"
        self.folder = folder

    @property
    def token(self) -> dict[str, str]:
        """The header with the token of a viewer."""
        tokens = json.loads((self.folder / f"{NAME}.tokens").read_text())
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

    def ready(self) -> None:
        """Wait until owner and gateway answer; enable the arm, also after a late cycle."""
        wait_until(self.answers, "owner and gateway answer")
        with RemoteRobot(NAME) as robot:
            robot.stop()
            wait_until(lambda: not robot.is_moving, "the arm is at rest")
            robot.acquire_lease(force=True)
            if robot.faults:
                robot.acknowledge()
                robot.recover()
            robot.enable()

    def begin(self) -> None:
        """Begin a motion that goes on without its client, towards the farther end."""
        with RawClient("mover") as client:
            here = truth(self.plant)[0][0]
            place = max(ENDS, key=lambda end: abs(end[0] - here))
            task = tasks.MoveJoints(positions=place, velocity_scaling=SPEED)
            client.request(m.Start(task=task, on_lease_loss="finish"), client.acquire())

    def until_moving(self) -> None:
        """Wait until the first joint moves at constant speed."""
        wait_until(lambda: self.speed() > _MOVING, "the arm moves", _BEGIN)
        former, now = 0.0, self.mean_speed()
        while abs(now - former) > 0.02 * now:
            former, now = now, self.mean_speed()

    def goal(self) -> m.GoalValue:
        """Return the newest goal."""
        with RawClient("look") as client:
            goals: tuple[m.GoalValue, ...] = client.request(m.ListGoals()).goals
            return goals[-1]

    def send(self, name: str, number: signal.Signals) -> None:
        """Send a signal to all processes of a name."""
        found = members(self.owner, name)
        assert found, name
        for pid in found:
            os.kill(pid, number)

    @contextmanager
    def suspended(self, name: str) -> Iterator[None]:
        """Suspend the processes of a name; at the end those go on that are still there."""
        found = self.gateway() if name == "web" else members(self.owner, name)
        assert found, name
        for pid in found:
            os.kill(pid, signal.SIGSTOP)
        yield
        for pid in found & (self.gateway() if name == "web" else members(self.owner, name)):
            os.kill(pid, signal.SIGCONT)

    def gateway(self) -> set[int]:
        """Return the process of the gateway."""
        children = Path(f"/proc/{self.owner.pid}/task/{self.owner.pid}/children").read_text()
        found = set()
        for pid in map(int, children.split()):
            with suppress(OSError):
                if b"\0web\0" in Path(f"/proc/{pid}/cmdline").read_bytes():
                    found.add(pid)
        return found

    @contextmanager
    def without_clients(self) -> Iterator[None]:
        """Suspend the process from which others fork, and kill that of the clients."""
        self.send("bioscara-forks", signal.SIGSTOP)
        self.send("bioscara-api", signal.SIGKILL)
        yield

    @contextmanager
    def full_disk(self) -> Iterator[None]:
        """Let no file of the owner and the process of the clients grow."""
        most = resource.RLIM_INFINITY
        for size in (0, most):
            for pid in (self.owner.pid, *members(self.owner, "bioscara-api")):
                resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, most))
            if not size:
                yield

    @contextmanager
    def unread_log(self) -> Iterator[None]:
        """Let no output of the owner be read from now on, with a full pipe."""
        self._output.block()
        with RawClient("noisy") as client:
            for _ in range(300):
                client.request(m.Report("r" * 500))
        yield

    @contextmanager
    def busy(self) -> Iterator[None]:
        """Keep the owner's event loop busy for 1 s."""
        self.owner.send_signal(signal.SIGUSR1)
        yield


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


class Door(NamedTuple):
    """A way to stop an arm.

    Attributes:
        prepare: Prepares it, and returns what stops.
        moves: Whether preparing begins the motion, one of its own.
        gateway: Whether it needs the gateway.
    """

    prepare: Callable[[Rig, ExitStack], Callable[[], object]]
    moves: bool = False
    gateway: bool = False


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


class Terminal:
    """A command in a terminal.

    Args:
        words: The command.
        stack: Ends it.
    """

    def __init__(self, words: tuple[str, ...], stack: ExitStack) -> None:
        self._near, far = pty.openpty()
        stack.callback(os.close, self._near)
        options = {"stdin": far, "stdout": far, "stderr": far, "env": environment()}
        self.program = stack.enter_context(
            running("-c", _IN_TERMINAL, *words, cold=True, **options)
        )
        os.close(far)
        self._text = ""
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        with suppress(OSError):
            while read := os.read(self._near, 1 << 16):
                self._text += read.decode(errors="replace")

    def wait_for(self, text: str) -> None:
        """Wait until a text is shown."""
        wait_until(lambda: text in self._text, text)

    def press(self, key: str) -> None:
        """Press a key."""
        os.write(self._near, key.encode())

    def interrupt(self) -> None:
        """Press Ctrl-C; the command ends."""
        self.press("\x03")
        self.program.wait(LIMIT)


def by_key(rig: Rig, stack: ExitStack) -> Callable[[], object]:
    here = truth(rig.plant)[0][0]
    place = max(ENDS, key=lambda end: abs(end[0] - here))
    words = ("move", "--arm", NAME, "--joints", *map(str, place))
    return Terminal(words, stack).interrupt


DOORS = {
    "`robot.stop()`": Door(by_python),
    "`bioscara stop`": Door(by_command),
    "HTTP": Door(by_http, gateway=True),
    "WebSocket": Door(by_websocket, gateway=True),
    "Ctrl-C": Door(by_key, moves=True),
}
"""Those without a browser and without ROS."""
DEAD = "nursery hung, clients' process dead"
STATES: dict[str, Callable[[Rig], AbstractContextManager[object]]] = {
    "usual": lambda _: nullcontext(),
    "clients' process hung": lambda rig: rig.suspended("bioscara-api"),
    "gateway hung": lambda rig: rig.suspended("web"),
    "nursery hung": lambda rig: rig.suspended("bioscara-forks"),
    DEAD: Rig.without_clients,
    "workers hung": lambda rig: rig.suspended("bioscara-worker"),
    "event loop busy for 1 s": Rig.busy,
    "disk full": Rig.full_disk,
    "log unread": Rig.unread_log,
}
"""Faults of the processes; the last one lasts."""


class Watch:
    """Records the motion of an arm in a block of code.

    Args:
        plant: Its socket.
    """

    def __init__(self, plant: Path) -> None:
        self._plant, self._ended = plant, threading.Event()
        self._rows: list[tuple[float, float]] = []
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Watch:
        self._thread.start()
        time.sleep(_BEFORE)
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.is_set():
            speed = max(map(abs, truth(self._plant)[1]))
            self._rows.append((time.monotonic(), speed))

    def deceleration(self, begin: float) -> float:
        """Return the time from a moment on to a speed below 95 % of that before [s]."""
        times, speeds = np.array(self._rows).T
        before = speeds[(times > begin - _BEFORE) & (times <= begin)]
        # Belts let the speed swing: below all that it was.
        slow = 0.95 * min(float(np.median(before)), float(before.min()))
        assert slow > 0.0, "the arm has stopped already"
        return max(float(times[speeds >= slow][-1]) - begin, 0.0)


def measure(rig: Rig, door: Door, state: str) -> float:
    """Return the time from STOP to the deceleration of the true arm, which comes to rest [s].

    The death of the process of the clients ends a motion that may not finish: then from that on.
    """
    rig.ready()
    with ExitStack() as stack:
        send = door.prepare(rig, stack)
        if not door.moves:
            rig.begin()
        rig.until_moving()
        number = rig.goal().goal
        with Watch(rig.plant) as watch:
            begin = time.monotonic()
            with STATES[state](rig):
                if not (door.moves and state == DEAD):
                    time.sleep(_BEFORE)
                    begin = time.monotonic()
                send()
                wait_until(lambda: at_rest(rig.plant), "the arm is at rest")
        wait_until(rig.answers, "owner and gateway answer")
        wait_until(lambda: rig.goal().status != "stopping", "the motion has ended")
        goal = rig.goal()
        assert (goal.goal, goal.status) == (number, "cancelled"), goal
    return watch.deceleration(begin)
