"""A simulated arm near its end stops, served until SIGTERM.

    arm_to_serve.py SPEED [J1 J2 J3 J4]
    arm_to_serve.py SPEED WORLD

SPEED is the factor by which its time is faster than real time. With positions it is homed, enabled
and there; with WORLD it was used before, and is among simulated bodies. A line "served" reports
that clients can connect.
"""

from __future__ import annotations

import signal
import sys
from pathlib import Path

from bioscara import Robot
from bioscara.api.runtime import folder
from bioscara.server.serve import ServeSettings, serving
from served import NAME, own_robot
from simulated import simulated_bus

RATE = 50
"""Cycles per second, as in the parameter files of the bringup: four joints that follow velocities
alone take more of the bus than those that follow both."""


def main() -> None:
    """Serve it."""
    evidence = Path(folder()) / "faults"
    if sys.argv[2:] == ["WORLD"]:
        # Imported here: it knows the physics engine.
        from physics.served_world import arm_in_world  # noqa: PLC0415

        with arm_in_world(evidence=evidence, rate=RATE) as robot:
            _serve(robot, float(sys.argv[1]), evidence)
        return
    speed, *at = map(float, sys.argv[1:])
    arm = simulated_bus(seed=2, homed=bool(at), at=at or None).arm
    with own_robot(evidence, arm=arm, rate=RATE) as robot:
        if at:
            robot.move_joints(at)
            robot.disable()
        _serve(robot, speed, evidence)


def _serve(robot: Robot, speed: float, evidence: Path) -> None:
    with serving(robot, ServeSettings(NAME, "sim", evidence=evidence, real_time_factor=speed)):
        print("served", flush=True)  # noqa: T201  for the test
        signal.sigwait({signal.SIGTERM})


if __name__ == "__main__":
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
    main()
