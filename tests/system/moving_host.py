"""A host that moves J4 until it is killed: ``moving_host.py SOCKET track|velocity``."""

from __future__ import annotations

import math
import sys

from bioscara.clock import MonotonicClock
from bioscara.drivers import Joint
from bioscara.model import load_parameters
from bioscara.sim import SocketBus

PERIOD = 0.01
SPEED = 1.0
SWING = 0.8
"""Amplitude of the tracked sine [rad]."""


def main() -> None:
    path, motion = sys.argv[1:]
    clock = MonotonicClock()
    joint = Joint(SocketBus(path), clock, load_parameters().joints[3])
    joint.init()
    joint.enable()
    if not joint.is_homed():
        joint.home()
    # At an end stop the encoder may read a hair beyond the limit.
    limit = joint.parameters
    start = min(max(joint.get_position(), limit.lower), limit.upper)
    away, begin = -math.copysign(1.0, start), clock.now()
    sys.stdout.write("moving\n")
    while True:
        time = clock.now() - begin
        if motion == "track":
            angle = time * SPEED / SWING
            position = start + away * SWING * (1.0 - math.cos(angle))
            joint.track(position, away * SPEED * math.sin(angle))
        else:
            joint.set_velocity(away * SPEED)
        clock.sleep_until(clock.now() + PERIOD)


if __name__ == "__main__":
    main()
