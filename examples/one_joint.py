"""Turn one joint a little and back, not homed: for the first power-up of an arm.

Give it a joint and a bus, for example j2 linux:1, or sim:/path.sock for an arm that `bioscara
simulate` serves; otherwise it turns j1 of a simulated arm of its own.
"""

import math
import sys
from pathlib import Path

from bioscara.bus.select import open_bus
from bioscara.clock import MonotonicClock
from bioscara.drivers import Joint
from bioscara.model import own_parameters
from bioscara.sim import FirmwareBus, SimulatedArm, SocketBus

NAME = sys.argv[1] if sys.argv[1:] else "j1"
DISTANCE = {"rad": 0.05, "m": 0.002}
SHARE = 0.2
"""Share of the limits of speed and acceleration."""
MICROSTEPS = 200 * 256
"""Microsteps per turn of the motor."""

joints = {each.name: each for each in own_parameters().joints}
if NAME not in joints:
    bus = NAME if ":" in NAME else "linux:1"
    sys.exit(
        f"there is no joint {NAME!r}; give one of {', '.join(joints)}, then the bus: "
        f"python {sys.argv[0]} j1 {bus}"
    )
parameters = joints[NAME]
distance, unit = DISTANCE[parameters.unit], parameters.unit
steps = round(distance * parameters.reduction / (2 * math.pi) * MICROSTEPS)
if sys.argv[2:]:
    kind, _, where = sys.argv[2].partition(":")
    bus = SocketBus(Path(where)) if kind == "sim" else open_bus(sys.argv[2])
    joint = Joint(bus, MonotonicClock(), parameters)
else:
    arm = SimulatedArm()
    joint = Joint(FirmwareBus(arm), arm.clock, parameters)

joint.init()
try:
    joint.enable()  # turns the motor by two to three degrees to check the encoder and its direction
    joint.set_max_acceleration(SHARE * parameters.max_acceleration)
    joint.set_max_velocity(SHARE * parameters.max_velocity)
    for sign in (1, -1):
        print(f"{NAME} moves by {sign * distance:+g} {unit}")
        joint.move_steps(sign * steps)
finally:
    joint.disable()
