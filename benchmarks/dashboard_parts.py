"""Process of the benchmark of the dashboard: a homed arm that notes the setpoints of each cycle."""

from __future__ import annotations

import json
import sys
import time

from bioscara import Robot
from bioscara.control.loop.loop import CycleReport
from bioscara.server.serve import ServeSettings, serving

START = (0.0, 0.2, 0.8, -0.5)
"""Where the arm stands [rad, m, rad, rad]."""


def main(name: str) -> None:
    """Serve it until a line arrives; then write time [s], number and setpoint of each cycle."""
    cycles: list[tuple[float, int, float]] = []
    with Robot.simulated() as robot:
        robot.home()
        robot.move_joints(START)
        with serving(robot, ServeSettings(name, "sim")) as made:
            runner = made.robot.runner

            def note(_: CycleReport) -> None:
                sample = made.owner.sample
                cycles.append((time.time(), sample.cycle, sample.commands[0]))

            # After the owner's own observer, which has just made the sample.
            runner.observers = (*runner.observers, note)
            print("ready", flush=True)
            sys.stdin.readline()
            print(json.dumps(cycles), flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
