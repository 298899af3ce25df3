"""An arm in a process of its own that was homed before: ``homed_arm.py SOCKET``."""

from __future__ import annotations

import signal
import sys

from bioscara.model import load_parameters
from bioscara.robot import Robot
from bioscara.sim import FirmwareBus, SimulatedArm, serve

NEAR = {"j1": -3.0, "j2": 0.33, "j3": 2.58, "j4": 2.9}
START = (-2.0, 0.25, 1.5, 1.5)


def main() -> None:
    ended: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: ended.append(number))
    arm = SimulatedArm(positions=NEAR)
    with Robot(FirmwareBus(arm), arm.clock, load_parameters(), "homing") as robot:
        robot.home()
        robot.move_joints(START)

    def listening() -> None:
        sys.stdout.write("listening\n")
        sys.stdout.flush()

    serve(arm, sys.argv[1], lambda: bool(ended), listening=listening)


if __name__ == "__main__":
    main()
