"""A program that moves an arm until it is ended: ``ended_program.py KIND SOCKET``."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable
from types import FrameType

from bioscara import BioscaraError, Operation, Robot
from system.observed_arm import START

THERE = (-1.0, 0.22, 0.5, 0.0)
SLOW = 0.4
"""Share of the speed limits with which a motion takes some seconds."""
FAST = 0.02
"""Speed above which the first joint surely moves [rad/s]."""


def connect() -> Robot:
    return Robot.connect(f"sim:{sys.argv[2]}")


def say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def begin(robot: Robot) -> Operation[None]:
    """Begin to move to the farther of two places, and return once the arm moves."""
    near = abs(robot.state.positions[0] - THERE[0]) < 0.3
    motion = robot.move_joints(START if near else THERE, velocity_scaling=SLOW, wait=False)
    while abs(robot.state.velocities[0]) < FAST:
        assert not motion.done
        time.sleep(0.01)
    say("moving")
    return motion


def in_a_with_that_waits() -> None:
    with connect() as robot:
        near = abs(robot.state.positions[0] - THERE[0]) < 0.3
        goal = START if near else THERE
        said: list[None] = []

        def on_cycle(_: object) -> None:
            if not said and abs(robot.state.velocities[0]) > FAST:
                said.append(say("moving"))

        robot.move_joints(goal, velocity_scaling=SLOW, on_cycle=on_cycle)


def in_a_with_that_sleeps() -> None:
    with connect() as robot:
        begin(robot)
        time.sleep(60.0)


def waiting_for_the_result() -> None:
    begin(connect().open()).result()


def opened() -> None:
    begin(connect().open())
    time.sleep(60.0)


def watched() -> None:
    robot = connect().open()
    robot.watch()
    begin(robot)
    time.sleep(60.0)


def returning() -> None:
    begin(connect().open())


def raising() -> None:
    begin(connect().open())
    raise ZeroDivisionError


def exiting() -> None:
    begin(connect().open())
    sys.exit(3)


def handling_the_signal() -> None:
    # Not an Event: its lock may be held where the handler interrupts the wait.
    ended: list[int] = []

    def handle(number: int, _: FrameType | None) -> None:
        say(f"handled {number}")
        ended.append(number)

    signal.signal(signal.SIGTERM, handle)
    robot = connect().open()
    begin(robot)
    while not ended:
        time.sleep(0.01)
    robot.close()


def closed() -> None:
    connect().open().close()
    say("closed")
    time.sleep(60.0)


def forking() -> None:
    """Move the arm, and let a forked child use it; the motion goes on, and the child lives on."""
    robot = connect().open()
    motion = begin(robot)
    reading, writing = os.pipe()
    if os.fork() == 0:
        calls: list[Callable[[], object]] = [
            lambda: robot.state, robot.stop, robot.home, robot.open, robot.shutdown, motion.wait,
            robot.gripper.open, lambda: robot.pose, robot.enable, robot.plan.unfold,
        ]  # fmt: skip
        for call in calls:
            try:
                call()
            except BioscaraError as error:
                say(f"refused: {type(error).__name__}: {error}")
        say(f"open {robot.is_open}")
        robot.close()
        signal.raise_signal(signal.SIGHUP) if os.fork() == 0 else os.wait()
        os.write(writing, b"done")
        time.sleep(60.0)
    os.read(reading, 4)
    say(f"forked {motion.done}")
    time.sleep(60.0)


if __name__ == "__main__":
    program: Callable[[], None] = globals()[sys.argv[1]]
    program()
