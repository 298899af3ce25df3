"""The true speed of the simulated arm's tool: that of its loads, sampled each millisecond."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bioscara import Robot
from bioscara.clock import SimulatedClock
from bioscara.kinematics import Joints, batch
from bioscara.model import load_parameters
from bioscara.robot import kinematics_of
from bioscara.sim import FirmwareBus
from simulated import simulated_bus

PARAMETERS = load_parameters()
NAMES = tuple(joint.name for joint in PARAMETERS.joints)
KINEMATICS = kinematics_of(PARAMETERS)
_STEP = 1e-3


class Loads:
    """A homed robot, and the loads at the far ends of its belts.

    Args:
        evidence: Folder for evidence of faults.

    Attributes:
        arm: The simulated arm.
        robot: The robot on it.
    """

    def __init__(self, evidence: Path) -> None:
        # Transactions pass unseen: 2 ms of a cycle of 10.
        self.arm = simulated_bus(seed=1, frequency=400e3, homed=True).arm
        clock = SimulatedClock(self.arm.now, self._run)
        self.robot = Robot(FirmwareBus(self.arm), clock, PARAMETERS, "loads", evidence=evidence)
        self._seen: list[tuple[float, ...]] = []
        self._looking = False
        self._quantities: tuple[Callable[[str], float], ...] = ()

    def __enter__(self) -> Loads:
        self.robot.__enter__()
        self.robot.enable()
        return self

    def __exit__(self, *error: object) -> None:
        self.robot.__exit__(None, None, None)

    def _run(self, duration: float) -> None:
        arm, seen = self.arm, self._seen
        # Time is counted in ticks of the controllers: a shorter time never passes.
        if not self._looking:
            arm.run(duration)
            return
        end = arm.now() + duration
        while (left := end - arm.now()) > 1e-6:
            arm.run(min(left, _STEP))
            seen.append(
                (
                    arm.now(),
                    *[quantity(name) for quantity in self._quantities for name in NAMES],
                )
            )

    def watch(self, motion: Callable[[], object]) -> np.ndarray:
        """Return time, positions and velocities of the loads during motion, shape (n, 9)."""
        return self._watch(motion, self.arm.position, self.arm.velocity)

    def watch_rotors(self, motion: Callable[[], object]) -> np.ndarray:
        """Return time and angles of the motors' rotors [microsteps] during motion, shape (n, 5)."""
        return self._watch(motion, lambda name: self.arm.field(name) - self.arm.load_angle(name))

    def _watch(
        self, motion: Callable[[], object], *quantities: Callable[[str], float]
    ) -> np.ndarray:
        self._quantities = quantities
        self._seen.clear()
        self._looking = True
        try:
            motion()
        finally:
            self._looking = False
        return np.array(self._seen)


def speeds(seen: np.ndarray) -> np.ndarray:
    """Return the speed of the tool of the loads [m/s]."""
    return batch.tool_speeds(KINEMATICS, seen[:, 1:5], seen[:, 5:])


def alone(seen: np.ndarray) -> np.ndarray:
    """Return the sum of the tool speeds that each joint's load alone would cause [m/s]."""
    total = np.zeros(len(seen))
    for column in range(5, 9):
        rates = np.zeros((len(seen), 4))
        rates[:, column - 5] = seen[:, column]
        total += batch.tool_speeds(KINEMATICS, seen[:, 1:5], rates)
    return total


def carried_on(seen: np.ndarray, since: float) -> tuple[float, float]:
    """Return the distance of the tool from a time on [m], and when it last moved by 10 mm/s [s]."""
    tail = seen[seen[:, 0] >= since]
    places = [KINEMATICS.forward(Joints(*row))[:3] for row in tail[:, 1:5].tolist()]
    way = max(math.dist(each, places[0]) for each in places)
    moving = np.flatnonzero(speeds(tail) > 0.01)
    return way, float(tail[moving[-1], 0] - since) if len(moving) else 0.0
