"""A host that moves J4 until it is killed: ``moving_host.py SOCKET track|velocity``."""

from __future__ import annotations

import math
import sys

from bioscara.drivers import Joint
from bioscara.errors import JointError
from bioscara.model import load_parameters
from bioscara.processes.scheduling import wake_on_time
from bioscara.sim import SocketBus

PERIOD = 0.01
SPEED = 1.0
SWING = 0.8
"""Amplitude of the tracked sine [rad]."""


def move(joint: Joint, motion: str) -> None:
    """Home the joint if need be, then move it away from the end stop that is nearer."""
    clock, limit = joint.clock, joint.parameters
    wake_on_time()
    joint.enable()
    if not joint.is_homed():
        joint.home()
    # At an end stop the encoder may read a hair beyond the limit.
    start = min(max(joint.get_position(), limit.lower), limit.upper)
    away, begin = -math.copysign(1.0, start), clock.now()
    sys.stdout.write("moving\n")
    sys.stdout.flush()
    while True:
        angle = (clock.now() - begin) * SPEED / SWING
        if motion == "track":
            position = start + away * SWING * (1.0 - math.cos(angle))
            joint.track(position, away * SPEED * math.sin(angle))
        else:
            joint.set_velocity(away * SPEED)
        clock.sleep_until(clock.now() + PERIOD)


def main() -> None:
    path, motion = sys.argv[1:]
    bus = SocketBus(path)
    joint = Joint(bus, bus.clock, load_parameters().joints[3])
    joint.init()
    for _ in range(3):
        try:
            move(joint, motion)
        except JointError as error:
            # A busy machine may keep this process from speaking in time: once more.
            sys.stderr.write(f"{error}\n")
            joint.clear_fault()


if __name__ == "__main__":
    main()
