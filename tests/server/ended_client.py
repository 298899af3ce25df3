"""A program that moves a served arm and then ends: ``ended_client.py KIND TERMINAL [ADDRESS SHA]``.

It says "moving" when the arm moves; with a kind that ends normally, it reads a line and says
"ending" with the time at which it ends.
"""

from __future__ import annotations

import os
import sys
import time

from bioscara import Robot
from bioscara.robot.arm_methods import ArmMethods
from served import NAME

OWN = (f"arm:{NAME}", "")
"""The address of the arm on this computer, without the fingerprint of a certificate."""
FAR = 1.2
"""Distance of both ends of the motion from the middle [rad]."""
FAST = 0.3
"""Speed above which the first joint surely moves at the speed of the motion [rad/s]."""


def say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def begin(robot: ArmMethods) -> None:
    """Begin to move to the farther of two places, and return once the arm moves."""
    first, *others = robot.state.positions
    robot.move_joints((-FAR if first > 0.0 else FAR, *others), wait=False)
    while abs(robot.state.velocities[0]) < FAST:
        time.sleep(0.01)
    say("moving")


def ending() -> None:
    """Wait for a line, then say that the program ends now."""
    sys.stdin.readline()
    say(f"ending {time.monotonic()}")


def main() -> None:
    kind, terminal, *way = sys.argv[1:]
    if terminal:
        # The first terminal that the first process of a session opens controls the session.
        os.open(terminal, os.O_RDWR)
    address, fingerprint = way or OWN
    robot = Robot.connect(address, fingerprint=fingerprint or None)
    if kind == "in a with":
        with robot:
            begin(robot)
            time.sleep(60.0)
    robot.open()
    begin(robot)
    if kind == "outside of a with":
        time.sleep(60.0)
    ending()
    if kind == "exception":
        raise ZeroDivisionError
    if kind == "sys.exit":
        sys.exit(3)
    if kind == "os._exit":
        os._exit(3)


if __name__ == "__main__":
    main()
