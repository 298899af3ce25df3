"""A host that moves the whole arm to and fro until it is killed: ``moving_robot.py SOCKET``."""

from __future__ import annotations

import sys

from bioscara import Robot
from bioscara.errors import BioscaraError
from system.observed_arm import START

THERE = (-1.0, 0.22, 0.5, 0.0)


def main() -> None:
    with Robot.connect(f"sim:{sys.argv[1]}") as robot:
        if robot.faults:
            robot.acknowledge()
            robot.recover()
        robot.enable()
        sys.stdout.write("moving\n")
        sys.stdout.flush()
        while True:
            try:
                robot.move_joints(THERE)
                robot.move_joints(START)
            except BioscaraError as error:
                # A busy machine may keep this process from speaking in time: once more.
                sys.stderr.write(f"{error}\n")
                if robot.faults:
                    robot.acknowledge()
                    robot.recover()


if __name__ == "__main__":
    main()
