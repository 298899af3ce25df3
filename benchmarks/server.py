"""The owner of an arm: latency of its samples, crowds of clients, stops, requests."""

from __future__ import annotations

import itertools
import math
import os
import socket
import threading
import time
from collections.abc import Iterator
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import zenoh

from benchmarks.measure import Row, at_most, duration, medians
from benchmarks.owner_process import Arm, served
from benchmarks.startup import process
from bioscara.api import framing, messages as m, runtime
from bioscara.robot import tasks

SAMPLES = 500
"""Samples of which the latency is measured."""
STOPS = int(os.environ.get("BIOSCARA_STOPS", "60"))
"""Number of stops; the limit of the p99 is meant for 1000."""
CROWD, DEAF = 50, 10
"""Subscribers, and how many of them never read."""
SECONDS = 5.0
"""Time for which the loop is observed with the crowd and without, in turns [s]."""
TURNS = int(os.environ.get("BIOSCARA_TURNS", "6"))


class Client:
    """A client that reads and writes frames, without the package's own one."""

    def __init__(self, name: str, client: str) -> None:
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(os.fspath(runtime.socket_of(name)))
        self._frames, self._messages = framing.MessageSplitter(framing.ANSWER_MAX), iter(())
        self._numbers = itertools.count(1)
        self.send(m.ClientHello(version=m.VERSION, client=client, session=os.urandom(8).hex()))
        self.receive(m.Welcome)

    def send(self, message: Any) -> None:
        """Send a message."""
        self.socket.sendall(framing.packed(message))

    def receive(self, *kinds: type[Any]) -> Any:
        """Return the next message of one of these kinds; others are dropped."""
        while True:
            for payload in self._messages:
                message = framing.from_owner.decode(payload)
                if isinstance(message, kinds):
                    return message
            self._messages = self._frames.feed(self.socket.recv(1 << 16))

    def ask(self, command: Any, epoch: int | None = None) -> Any:
        """Return the result of a command."""
        number = next(self._numbers)
        self.send(m.ClientRequest(id=number, command=command, epoch=epoch))
        answer = self.receive(m.Response, m.RequestFailed)
        if isinstance(answer, m.RequestFailed):
            raise RuntimeError(answer.failure.text)
        return answer.result


def by_chance(first: int, second: int) -> float:
    """Return two standard deviations of the difference of two counts of rare events."""
    return 2.0 * math.sqrt(first + second)


def _percentiles(values: list[float]) -> tuple[float, float]:
    return float(np.percentile(values, 50)), float(np.percentile(values, 99))


def _latency(arm: Arm, client: Client) -> list[float]:
    """Return the time from the end of a cycle to the client, for each sample [s]."""
    client.ask(m.Subscribe(states=True))
    client.receive(m.StateSample)
    arm.tell("mark")
    arrived = []
    for _ in range(SAMPLES):
        client.receive(m.StateSample)
        arrived.append(time.monotonic())
    ends = arm.cycles()[:, 0]
    client.ask(m.Subscribe())
    # Each sample is that of the last cycle that ended before it came.
    return [moment - ends[np.searchsorted(ends, moment) - 1] for moment in arrived]


def _sender(path: str, size: int) -> None:
    """Send a message of that size at 100 Hz, with the time, as a bare program would."""
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(path)
        listener.listen()
        connection, _ = listener.accept()
        due = time.monotonic()
        for _ in range(SAMPLES):
            due += 0.01
            time.sleep(max(due - time.monotonic(), 0.0))
            connection.sendall(f"{time.monotonic():.9f}".ljust(size).encode())


def _bare(folder: str, size: int) -> list[float]:
    """Return the latency of a bare Unix socket between two processes [s]."""
    path = f"{folder}/bare"
    sender = get_context("spawn").Process(target=_sender, args=(path, size))
    sender.start()
    while not Path(path).exists():
        time.sleep(0.01)
    found = []
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(path)
        while data := connection.recv(size, socket.MSG_WAITALL):
            found.append(time.monotonic() - float(data))
    sender.join()
    return found


def _zenoh(arm: Arm, topic: str) -> list[float]:
    """Return the latency of Zenoh over a Unix socket between two processes [s]."""
    config = zenoh.Config.from_json5(
        '{mode: "peer", scouting: {multicast: {enabled: false}},'
        f'connect: {{endpoints: ["unixsock-stream/{topic}"]}}}}'
    )
    found = []
    with zenoh.open(config) as session:
        subscriber = session.declare_subscriber("state")
        time.sleep(0.5)
        arm.tell("zenoh")
        for _ in range(250):
            payload = subscriber.recv().payload.to_bytes()
            found.append(time.monotonic() - float(payload))
    return found


def _latencies(arm: Arm, name: str, folder: str, topic: str) -> list[Row]:
    client = Client(name, "latency")
    own = _latency(arm, client)
    size = len(framing.encode_packed(client.ask(m.GetState())))
    bare, peer = _bare(folder, size), _zenoh(arm, topic)
    (p50, p99), (bare50, bare99), (peer50, peer99) = map(_percentiles, (own, bare, peer))
    return [
        at_most(
            "a sample from the end of its cycle to a client in another process, median",
            p50,
            2,
            peer50,
            f"Zenoh; a bare Unix socket {duration(bare50)}",
            f"{'above' if p50 > 200e-6 else 'within'} 200 us",
        ),
        at_most(
            "the same, p99",
            p99,
            8,
            bare99,
            f"a bare Unix socket; Zenoh {duration(peer99)}",
            f"{'above' if p99 > 1e-3 else 'within'} 1 ms",
        ),
    ]


def _reading(client: Client) -> None:
    """Read until the connection ends."""
    try:
        while client.socket.recv(1 << 16):
            pass
    except OSError:
        pass


def _crowd(arm: Arm, name: str) -> list[Row]:
    alone: list[float] = []
    crowded: list[float] = []
    before = arm.memory()
    most = before
    for _ in range(TURNS):
        alone += arm.lateness(SECONDS)
        clients = [Client(name, f"subscriber {number}") for number in range(CROWD)]
        for client in clients:
            client.ask(m.Subscribe(states=True, events_after=0))
        readers = [threading.Thread(target=_reading, args=(client,)) for client in clients[DEAF:]]
        for reader in readers:
            reader.start()
        crowded += arm.lateness(SECONDS)
        most = max(most, arm.memory())
        for client in clients:
            client.socket.shutdown(socket.SHUT_RDWR)
        for reader in readers:
            reader.join()
        for client in clients:
            client.socket.close()
    (_, p99), (_, calm) = _percentiles(crowded), _percentiles(alone)
    missed, missed_alone = (sum(late > 0.01 for late in each) for each in (crowded, alone))
    growth = most - before
    return [
        Row(
            f"lateness of the loop with {CROWD} subscribers, {DEAF} of which never read, p99",
            f"{duration(p99)} ({p99 / calm:.2f} times); {missed} of {len(crowded)} a cycle late",
            f"with none, in turns: {duration(calm)}; {missed_alone} of {len(alone)} a cycle late",
            "at most 1.5 times, and no more cycles late than two standard deviations",
            p99 <= 1.5 * calm and missed <= missed_alone + by_chance(missed, missed_alone),
            p99 / (1.5 * calm),
        ),
        Row(
            "memory of the owner with them",
            f"{growth / 2**20:.1f} MiB more",
            f"the limit for each that does not read, 8 MiB: {DEAF * 8} MiB",
            "at most 0.25 times",
            growth <= 0.25 * DEAF * (8 << 20),
            growth / (0.25 * DEAF * (8 << 20)),
        ),
    ]


def stop_delays(arm: Arm, name: str, count: int) -> list[float]:
    """Return the times from a stop in this process to the first setpoint that is slower [s]."""
    client, stopper = Client(name, "mover"), Client(name, "stopper")
    delays = []
    goal = 1.4
    for _ in range(count):
        lease = client.ask(m.AcquireLease(time_to_live=60.0, force=True)).lease
        motion = tasks.MoveJoints(positions=(goal, 0.2, 0.0, 0.0), velocity_scaling=1.0)
        started = client.ask(m.Start(task=motion), lease.epoch)
        arm.tell("mark")
        # The speed changes evenly now.
        time.sleep(1.2)
        sent = time.monotonic()
        stopper.ask(m.StopAll())
        while not client.ask(m.GetGoal(started.goal.goal)).goal.done:
            time.sleep(0.02)
        ends, speeds, *_ = arm.cycles().T
        speeds = np.abs(speeds)
        index = int(np.searchsorted(ends, sent))
        gains = np.diff(speeds[index - 2 :])
        slower = np.flatnonzero(gains[1:] < gains[0] - 1e-6)
        delays.append(float(ends[index + slower[0]] - sent))
        goal = -goal if abs(client.ask(m.GetState()).positions[0] - goal) < 0.5 else goal
    return delays


def _stop(arm: Arm, name: str) -> Row:
    """Measure from the stop in this process to the first setpoint that is slower."""
    p50, p99 = _percentiles(stop_delays(arm, name, STOPS))
    return Row(
        "STOP in another process to the end of the cycle of the first setpoint that brakes, p99",
        f"{duration(p99)}, median {duration(p50)}, {STOPS} stops",
        "a cycle of 10 ms and 2 ms",
        "at most 1 time",
        p99 <= 12e-3,
        p99 / 12e-3,
    )


def _requests(name: str) -> list[Row]:
    client, other = Client(name, "asking"), Client(name, "other")
    query, echo = medians(lambda: client.ask(m.GetState()), _echo().__next__, rounds=400)
    takers = itertools.cycle((client, other))
    taken = []
    for _ in range(200):
        taker, begin = next(takers), time.perf_counter()
        taker.ask(m.AcquireLease(force=True))
        taken.append(time.perf_counter() - begin)
    p50, p99 = _percentiles(taken)
    return [
        Row(
            "state queries on one connection, one after the other",
            f"{1 / query:.0f} per second, {query / echo:.1f} times the bare round trip",
            f"a byte to a thread and back over a Unix socket: {duration(echo)}",
            "at least 5000 per second",
            query <= 200e-6,
            query / 200e-6,
        ),
        Row(
            "a lease taken over from another client, p99",
            f"{duration(p99)}, median {duration(p50)}",
            f"a state query, median: {duration(query)}",
            "at most 5 ms",
            p99 <= 5e-3,
            p99 / 5e-3,
        ),
    ]


def _echo() -> Iterator[bytes]:
    """Yield the answers of a thread that returns each byte."""
    here, there = socket.socketpair()

    def answer() -> None:
        while byte := there.recv(1):
            there.sendall(byte)

    threading.Thread(target=answer, daemon=True).start()
    while True:
        here.sendall(b"x")
        yield here.recv(1)


def _stop_program() -> Row:
    programs = (process("-c", "pass"), process("-c", "import bioscara.stop"))
    for program in programs:
        program()
    empty, own = medians(*programs, rounds=21)
    return at_most(
        "a process that imports all that `bioscara stop` needs",
        own,
        4,
        empty,
        "an empty Python",
        f"{'above' if own > 60e-3 else 'within'} 60 ms",
    )


def rows() -> list[Row]:
    """Measure an owner in a process of its own."""
    with TemporaryDirectory(prefix="b") as folder:
        os.environ[runtime.VARIABLE] = folder
        name, topic = "bench", f"{folder}/zenoh"
        with served(name, topic) as arm:
            return [
                *_latencies(arm, name, folder, topic),
                *_crowd(arm, name),
                _stop(arm, name),
                *_requests(name),
                _stop_program(),
            ]
