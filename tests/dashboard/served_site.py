"""A simulated arm near its end stops, served with its gateway for browsers until SIGTERM.

    served_site.py ORIGINAL SPEED [J1 J2 J3 J4]

ORIGINAL are the names of joints with original firmware; or WORLD for one among simulated bodies,
which was used before. SPEED is the factor by which its time is
faster than real time. With positions it is homed, enabled and there. A line "served URL" has the
address of the page.
"""

from __future__ import annotations

import signal
import sys
import threading
from pathlib import Path

from bioscara import Robot
from bioscara.api.runtime import folder
from bioscara.server.serve import ServeSettings, serving
from bioscara.web.gateway import Gateway, GatewaySettings
from physics.served_world import arm_in_world
from served import NAME, own_robot
from simulated import simulated_bus
from web.gateways import running_gateway


def main() -> None:
    """Serve it."""
    speed, *at = map(float, sys.argv[2:])
    evidence = Path(folder()) / "faults"
    overlay = Path(folder()) / "arm.yaml"
    overlay.touch()
    settings = GatewaySettings(NAME, port=0, recordings=Path(folder()) / "recordings")
    ended = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: ended.set())
    with _robot(sys.argv[1], at, evidence) as robot:
        if at:
            robot.move_joints(at)
        with (
            serving(robot, ServeSettings(NAME, "sim", overlay, evidence, real_time_factor=speed)),
            running_gateway(Gateway(settings)) as gateway,
        ):
            print(f"served {gateway.url} {gateway.token_file}", flush=True)  # noqa: T201  for the test
            ended.wait()


def _robot(original: str, at: list[float], evidence: Path) -> Robot:
    if original == "WORLD":
        return arm_in_world(evidence=evidence)
    arm = simulated_bus(v1=original.split(), seed=2, homed=bool(at), at=at or None).arm
    return own_robot(evidence, arm=arm)


if __name__ == "__main__":
    main()
