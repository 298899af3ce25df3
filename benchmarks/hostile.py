"""A moving arm with hostile viewers: lateness of its control loop, and STOP."""

from __future__ import annotations

import itertools
import os
import random
import select
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import get_context
from tempfile import TemporaryDirectory

import msgspec
import numpy as np

from benchmarks.measure import Row, at_most, duration
from benchmarks.owner_process import served
from benchmarks.server import Client, stop_delays
from bioscara import Pose
from bioscara.api import framing, messages as m, runtime
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.robot import tasks

VIEWERS = int(os.environ.get("BIOSCARA_VIEWERS", "8"))
SECONDS = 8.0
"""Time for which the loop is observed with the attack and without, in turns [s]."""
TURNS = int(os.environ.get("BIOSCARA_TURNS", "2"))
STOPS = 30
PEACE = (0.2, 0.0, 0.8, -0.5)
_BLOCK = 64
"""Questions that are sent at once."""


def _raster(count: int) -> m.MakePlan:
    """Return the question for a path of many waypoints."""
    points = [
        Waypoint(Pose(0.35 + 0.02 * (row % 2), -0.1 + 0.2 * row / count, 0.15, 0.0))
        for row in range(count)
    ]
    return m.MakePlan(tasks.MoveSequence(waypoints=tuple(points)))


def questions() -> list[m.AnyCommand]:
    """Return a question of every kind, with the largest answers."""
    return [
        m.GetState(), m.GetDescription(), m.GetWorkspace(), m.GetHistory(begin=0.0, points=5000),
        m.GetSimulation(), m.GetFaults(), m.GetGoal(1), m.GetTrajectories(1), m.GetLease(),
        m.GetStatistics(), m.GetJoints(), m.GetParameters(), m.ListControllers(),
        m.ListFlightRecords(), m.ListGoals(), m.GetLog(0), m.GetIntrospection(),
        m.QueryController("none", 0.0),
        m.MakePlan(tasks.MoveNamed(name="center")),
        m.MakePlan(tasks.MoveJoints(positions=(0.1, 0.2, 0.6, 0.3))), _raster(300),
        m.Subscribe(states=True, controllers=True, events_after=0), m.Subscribe(),
    ]  # fmt: skip


def _attack(name: str, viewers: int) -> None:
    """Ask an owner all questions, as fast as it reads, until this process is ended.

    The questions are encoded before, and one process has all viewers: like attackers on other
    computers, they take little of this one.
    """
    chance = random.Random(1)
    clients = [Client(name, f"viewer {number}") for number in range(viewers)]
    blocks = []
    for _ in range(8):
        asked = [chance.choice(questions()) for _ in range(_BLOCK)]
        blocks.append([framing.encode_packed(each) for each in asked])
    numbers = itertools.count(1)
    poll = select.poll()
    waiting = {}
    for client in clients:
        client.socket.setblocking(False)
        poll.register(client.socket, select.POLLIN | select.POLLOUT)
        waiting[client.socket.fileno()] = [client.socket, b""]
    while True:
        for file, event in poll.poll():
            connection, left = waiting[file]
            try:
                if event & select.POLLIN and not connection.recv(1 << 20):
                    poll.unregister(file)  # it was cut off
                    continue
                if event & select.POLLOUT:
                    left = left or b"".join(map(_request, numbers, chance.choice(blocks)))
                    waiting[file][1] = left[connection.send(left) :]
            except BlockingIOError:
                continue
            except OSError:
                poll.unregister(file)


def _request(number: int, command: bytes) -> bytes:
    """Return a request as bytes, of a command that is encoded."""
    return framing.packed(m.ClientRequest(id=number, command=msgspec.Raw(command)))


@contextmanager
def attacked(name: str, viewers: int = VIEWERS) -> Iterator[None]:
    """Let hostile viewers attack an owner."""
    context = get_context("spawn")
    process = context.Process(target=_attack, args=(name, viewers))
    process.start()
    time.sleep(2.0)
    try:
        yield
    finally:
        process.kill()
        process.join()


class Mover:
    """A client that jogs the arm to and fro, and counts what ended its motion."""

    def __init__(self, name: str) -> None:
        self._client = Client(name, "mover")
        self._epoch = self._client.ask(m.AcquireLease(time_to_live=60.0)).lease.epoch
        self.faults = 0

    def move(self, seconds: float) -> None:
        """Move for a time."""
        end, client = time.monotonic() + seconds, self._client
        for sign in itertools.cycle((1.0, -1.0)):
            if time.monotonic() > end:
                return
            task = tasks.MoveJoints(positions=(0.5 * sign, *PEACE[1:]), velocity_scaling=0.5)
            begun = client.ask(m.Start(task=task), self._epoch)
            while client.ask(m.GetGoal(begun.goal.goal)).goal.status in {"running", "waiting"}:
                time.sleep(0.05)
            state = client.ask(m.GetGoal(begun.goal.goal)).goal
            if state.status != "succeeded":
                self.faults += 1
                print(f"  the motion {state.status}: {state.failure}", flush=True)
                client.ask(m.AcquireLease(time_to_live=60.0, force=True))
                return


def arm_name() -> str:
    """Return the name of the arm."""
    return "attacked"


def run() -> list[Row]:
    """Measure, and compare with the same attack on another arm of this computer."""
    late: dict[str, list[float]] = {"here": [], "elsewhere": []}
    with TemporaryDirectory(prefix="b") as folder:
        os.environ[runtime.VARIABLE] = folder
        with served(arm_name()) as arm, served("other"):
            mover = Mover(arm_name())
            for place, name in [("elsewhere", "other"), ("here", arm_name())] * TURNS:
                with attacked(name):
                    moving = threading.Thread(target=mover.move, args=(SECONDS,))
                    moving.start()
                    late[place] += arm.lateness(SECONDS)
                    moving.join()
                print(
                    place,
                    [duration(float(np.percentile(late[place], q))) for q in (50, 99, 100)],
                    arm.memory() >> 20,
                    "MiB",
                    flush=True,
                )
            with attacked(arm_name()):
                stops = stop_delays(arm, arm_name(), STOPS)
            print("stops", sorted(round(1e3 * s, 1) for s in stops), flush=True)
    here, elsewhere = (float(np.percentile(late[each], 99)) for each in ("here", "elsewhere"))
    stop = float(np.percentile(stops, 99))
    return [
        at_most(
            "lateness of the loop beside 8 hostile viewers, p99",
            here,
            1.5,
            elsewhere,
            "the same attack on another arm",
        ),
        Row("faults of the moving arm", str(mover.faults), "none", "0", mover.faults == 0),
        Row(
            "STOP beside 8 hostile viewers, p99",
            duration(stop),
            "the loop's period: 10 ms",
            "at most 20 ms",
            stop <= 0.02,
        ),
    ]


if __name__ == "__main__":
    for row in run():
        print(row)
