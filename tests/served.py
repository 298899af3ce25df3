"""A simulated arm that an owner in this process serves, and clients of it.

:func:`arm_served` serves an arm that stands close to its end stops, as in simulated.py, in fast
simulated time. :class:`RawClient` speaks the frames of the API itself, also wrong ones.
"""

from __future__ import annotations

import os
import shutil
import socket
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import UnionType
from typing import Any, Self

from bioscara import Robot
from bioscara.api import framing, messages as m
from bioscara.api.failures import error_of
from bioscara.api.runtime import VARIABLE, find
from bioscara.drivers import Gripper, Pwm
from bioscara.model import ArmParameters
from bioscara.robot.connection.pacing import PacedClock
from bioscara.server.serve import Served, ServeSettings, serving
from bioscara.sim import BenchBus, SimulatedArm, SimulatedServo
from programs import LIMIT, wait_until
from simulated import ARM, simulated_bus

NAME = "left"
HALF = (0.3, 0.2, 0.8, -0.5)
"""Positions far from all limits."""
SPEED = 50.0
"""Factor by which the time of the served arm is faster than real time."""


def own_robot(
    evidence: Path,
    *,
    seed: int = 2,
    parameters: ArmParameters = ARM,
    arm: SimulatedArm | None = None,
    rate: int | None = None,
) -> Robot:
    """Return a robot with a gripper, on an arm that was used before or a new one near its stops."""
    arm = arm or simulated_bus(seed=seed).arm
    clock = PacedClock(arm.clock)
    jaws = parameters.gripper
    servo = SimulatedServo(jaws.outputs[0])
    gripper = Gripper(Pwm(jaws.outputs, clock, servo.root), jaws, servo.root / "width")
    return Robot(
        BenchBus(arm, seed),
        clock,
        parameters,
        "simulated",
        gripper=gripper,
        servo=servo,
        evidence=evidence,
        rate=rate,
    )


@contextmanager
def runtime_folder() -> Iterator[Path]:
    """Let owners and clients in this process use a folder of their own, with a short path."""
    before = os.environ.get(VARIABLE)
    folder = Path(tempfile.mkdtemp(prefix="b"))
    os.environ[VARIABLE] = str(folder)
    try:
        yield folder
    finally:
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def arm_served(
    *,
    speed: float = SPEED,
    at: tuple[float, ...] | None = HALF,
    arm: SimulatedArm | None = None,
    **settings: Any,
) -> Iterator[Served]:
    """Serve an arm in a runtime folder of its own.

    Args:
        speed: Factor by which its time is faster than real time.
        at: Where it stands, homed; None for an arm that is not homed.
        arm: The arm, which may be homed already; None for a new one.
        **settings: Further ones of :class:`ServeSettings`.
    """
    with runtime_folder() as folder:
        evidence = folder / "faults"
        given = ServeSettings(NAME, "sim", evidence=evidence, real_time_factor=speed)
        arm = arm or simulated_bus(seed=2, homed=at is not None, at=at).arm
        with own_robot(evidence, arm=arm) as robot:
            if at is not None:
                robot.home()
                robot.move_joints(at)
            with serving(robot, replace(given, **settings)) as served:
                yield served


def events_since(served: Served, number: int) -> list[m.Event]:
    """Return the events of an owner after the one with a number."""
    found = []
    while (event := served.owner.events.after(number)) is not None:
        found.append(event)
        number = event.number
    return found


def eventually(condition: Callable[[], object], deadline: float = LIMIT, what: str = "") -> None:
    """Wait until a condition holds."""
    wait_until(lambda: bool(condition()), what or "the condition", deadline)


class RawClient:
    """A client that speaks the frames of the API itself.

    Args:
        name: Name of the client.
        session: Name of its session.
        greet: Whether to say hello.
        path: The owner's socket; None for the usual one.

    Attributes:
        events: The events that have come.
        samples: The state samples that have come.
        records: The records that have come.
        welcome: The owner's greeting.
    """

    def __init__(
        self,
        name: str = "raw",
        session: str = "",
        *,
        greet: bool = True,
        path: Path | None = None,
    ) -> None:
        self.session = session or os.urandom(8).hex()
        self.name = name
        self.events: list[m.Event] = []
        self.samples: list[m.StateSample] = []
        self.records: list[m.GoalCycle] = []
        self.number = 0
        self._answers: dict[int, m.Response | m.RequestFailed] = {}
        self._frames = framing.MessageSplitter(framing.ANSWER_MAX)
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            # With a timeout it would fail where more clients wait than the queue holds.
            self.socket.connect(os.fspath(path or find(NAME).socket))
            self.socket.settimeout(LIMIT)
            if greet:
                self.hello()
        except BaseException:
            self.socket.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def hello(self) -> None:
        """Say hello, and read the greeting."""
        self.send(m.ClientHello(version=m.VERSION, client=self.name, session=self.session))
        self.welcome = self.read(m.Welcome)

    def send(self, message: object) -> None:
        """Send a message of any kind."""
        self.socket.sendall(framing.packed(message))

    def send_bytes(self, data: bytes) -> None:
        """Send bytes, which the owner may refuse to take."""
        self.socket.sendall(data)

    def begin(self, command: m.AnyCommand, epoch: int | None = None, number: int = 0) -> int:
        """Send a request; return its number."""
        self.number = number or self.number + 1
        self.send(m.ClientRequest(id=self.number, command=command, epoch=epoch))
        return self.number

    def read(self, kind: type[Any] | UnionType) -> Any:
        """Return the next message of a kind; events, samples and records are kept."""
        for message in self._pulled():
            if isinstance(message, kind):
                return message
        raise EOFError("the owner has ended the connection")

    def answer(self, number: int) -> m.Response | m.RequestFailed:
        """Return the answer to a request."""
        if number not in self._answers:
            for message in self._pulled():
                if isinstance(message, m.Response | m.RequestFailed) and message.id == number:
                    break
            else:
                raise EOFError("the owner has ended the connection")
        return self._answers.pop(number)

    def request(self, command: m.AnyCommand, epoch: int | None = None) -> Any:
        """Send a request and return its result, or raise its error."""
        answer = self.answer(self.begin(command, epoch))
        if isinstance(answer, m.RequestFailed):
            raise error_of(answer.failure)
        return answer.result

    def acquire(self, *, force: bool = False, time_to_live: float = 60.0) -> int:
        """Take the lease; return its epoch."""
        state = self.request(m.AcquireLease(time_to_live=time_to_live, force=force))
        assert isinstance(state, m.LeaseState)
        return state.lease.epoch

    def event(self, what: str, **wanted: object) -> m.Event:
        """Return the first event of a kind, and of a goal if one is given; needs a subscription."""

        def found() -> m.Event | None:
            for event in self.events:
                goal = None if event.goal is None else event.goal.goal
                if event.what == what and wanted.get("goal", goal) == goal:
                    return event
            return None

        while (event := found()) is None:
            self.read(m.Event)
        return event

    def ended(self) -> bool:
        """Return whether the owner has ended the connection, once it has."""
        try:
            while self.socket.recv(1 << 16):
                pass
        except ConnectionResetError:
            return True
        except TimeoutError:
            return False
        return True

    def _pulled(self) -> Iterator[Any]:
        while True:
            # Not the generator of all messages: the rest of one call is for the next one.
            payload = next(self._frames.feed(b""), None)
            if payload is None:
                data = self.socket.recv(1 << 16)
                if not data:
                    return
                payload = next(self._frames.feed(data), None)
                if payload is None:
                    continue
            message = framing.from_owner.decode(payload)
            if isinstance(message, m.Event):
                self.events.append(message)
            elif isinstance(message, m.StateSample):
                self.samples.append(message)
            elif isinstance(message, m.GoalCycle):
                self.records.append(message)
            elif isinstance(message, m.Response | m.RequestFailed) and message.id is not None:
                self._answers[message.id] = message
            yield message


def memory_of(client: RawClient) -> int:
    """Return the resident memory of the owner [byte]."""
    statistics = client.request(m.GetStatistics())
    assert isinstance(statistics, m.Statistics)
    return statistics.memory


def good_client_works() -> None:
    """Raise unless another client can look at the arm and move it."""
    with Robot.connect(f"arm:{NAME}") as robot:
        begin = time.monotonic()
        height = robot.state.positions[1]
        robot.move_relative(z=0.002 if height < HALF[1] else -0.002)
        assert abs(robot.state.positions[1] - height) > 1e-3
        assert time.monotonic() - begin < LIMIT
