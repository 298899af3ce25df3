"""A client that moves a served arm to and fro until it is killed: ``mover.py ARM``.

It writes ``moving`` once the arm moves at constant speed, ``turning`` before the end of the motion,
``stopped TIME`` after each motion that was cancelled, with the time at which the first sample of
the deceleration arrived, and ``fault TEXT`` when the arm has one. The times are of the clock that
all processes share.
"""

from __future__ import annotations

import sys
import time

from bioscara.api import messages as m
from bioscara.api.runtime import find
from bioscara.errors import BioscaraError
from bioscara.robot import tasks
from served import RawClient

ENDS = ((-1.2, 0.2, 0.8, -0.5), (1.2, 0.2, 0.8, -0.5))
SPEED = 0.3
"""Share of the largest velocity: one way takes some 25 s."""
STEADY = 5
"""Samples of equal speed after which it is constant."""
NEAR = 0.2
"""Distance from the end of the motion at which the arm turns soon [rad]."""
SLOWER = 0.95
"""Share of the constant speed below which the arm decelerates."""


class Watch:
    """Finds in the samples of one motion when it became constant, and when it decelerated."""

    def __init__(self) -> None:
        self._last: m.StateSample | None = None
        self._speed = self._steady = 0.0
        self.decelerated = 0.0
        self._is_near = False

    def is_near(self, end: float) -> bool:
        """Return whether the arm has just come near the end of its motion."""
        was, last = self._is_near, self._last
        self._is_near = last is not None and abs(last.commands[0] - end) < NEAR
        return self._is_near and not was

    def look(self, sample: m.StateSample) -> bool:
        """Take a sample; return whether the speed is constant from this one on."""
        last, self._last = self._last, sample
        if last is None or sample.time <= last.time:
            return False
        speed = abs(sample.commands[0] - last.commands[0]) / (sample.time - last.time)
        if self._steady >= STEADY:
            if speed > SLOWER * self._speed:
                self.decelerated = 0.0  # A late cycle.
            elif not self.decelerated:
                self.decelerated = time.monotonic()
            return False
        same = speed > 0.0 and abs(speed - self._speed) < 1e-3 * speed
        self._steady = self._steady + 1 if same else 0
        self._speed = speed
        return self._steady >= STEADY


def say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def move(client: RawClient, epoch: int, task: m.AnyTask, end: float = 0.0) -> str:
    """Carry a task out, which moves the first joint to ``end``; return how its goal has ended."""
    watch = Watch()
    goal = client.request(m.Start(task=task), epoch).goal
    client.samples.clear()
    while True:
        message = client.read(m.StateSample | m.Event)
        if isinstance(message, m.StateSample):
            client.samples.clear()
            if message.fault != "clear":
                say(f"fault {client.request(m.GetFaults()).faults}")
                raise SystemExit(1)
            if watch.look(message):
                say("moving")
            elif watch.is_near(end):
                say("turning")
        elif message.goal is not None and message.goal.goal == goal.goal and message.goal.done:
            client.events.clear()
            if message.goal.status != "succeeded":
                say(f"stopped {watch.decelerated}")
            return str(message.goal.status)


def main() -> None:
    with RawClient("mover", path=find(sys.argv[1]).socket) as client:
        client.request(m.Subscribe(states=True, events_after=client.welcome.last_event))
        move(client, client.acquire(), tasks.Enable())
        turn = 0
        while True:
            try:
                task = tasks.MoveJoints(
                    positions=ENDS[turn % 2], velocity_scaling=SPEED, acceleration_scaling=1.0
                )
                turn += move(client, client.acquire(), task, ENDS[turn % 2][0]) == "succeeded"
            except BioscaraError as error:
                # Another STOP came before the next motion.
                sys.stderr.write(f"{error}\n")
                time.sleep(0.1)


if __name__ == "__main__":
    main()
