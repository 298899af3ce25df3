"""Plan motions of many kinds and print a checksum of each, to compare computers bit for bit.

``python tools/motion_bits.py [COUNT]``, with the number of motions of each kind: a line is the
kind, the number of points and the SHA-256 of all numbers. It imports only the installed package.
"""

from __future__ import annotations

import hashlib
import random
import sys
from collections.abc import Iterator

import numpy as np

from bioscara import Pose, Robot, Trajectory, Waypoint
from bioscara.errors import BioscaraError
from bioscara.robot.planner import Plan

COUNT = 12
"""Motions of each kind, if no other number is given."""
SEED = 1


def checksum(trajectory: Trajectory) -> str:
    """Return the SHA-256 of all numbers of a trajectory."""
    numbers = (
        trajectory.times, trajectory.positions, trajectory.velocities, trajectory.accelerations,
    )  # fmt: skip
    digest = hashlib.sha256()
    for array in numbers:
        digest.update(np.ascontiguousarray([] if array is None else array, "<f8").tobytes())
    return digest.hexdigest()


def motions(robot: Robot, draw: random.Random, count: int) -> Iterator[tuple[str, Trajectory]]:
    """Yield plans of all kinds between places that are drawn at random, where there is one."""
    plan = robot.plan

    def place() -> Pose:
        return Pose(
            draw.uniform(0.15, 0.3), draw.uniform(-0.2, 0.2), draw.uniform(0.15, 0.3),
            draw.uniform(-1.0, 1.0),
        )  # fmt: skip

    def sequence() -> Plan:
        places = [place() for _ in range(draw.randint(2, 5))]
        blends = [draw.uniform(0.0, 0.02) for _ in places[:-1]] + [0.0]
        return plan.move_sequence(
            [Waypoint(at, blend=blend) for at, blend in zip(places, blends, strict=True)]
        )

    kinds = {
        "joints": lambda: plan.move_joints(
            [draw.uniform(-1, 1), draw.uniform(0.1, 0.3), draw.uniform(0.3, 2), draw.uniform(-1, 1)]
        ),
        "to": lambda: plan.move_to(place()),
        "linear": lambda: plan.move_linear(place()),
        "relative": lambda: plan.move_relative(draw.uniform(-0.1, 0.1), draw.uniform(-0.1, 0.1)),
        "circular": lambda: plan.move_circular(place(), place()),
        "sequence": sequence,
    }
    for kind, planned in kinds.items():
        found = 0
        for _ in range(100 * count):
            try:
                trajectory = planned().trajectory
            except BioscaraError:
                continue
            yield kind, trajectory
            found += 1
            if found == count:
                break


def main(count: int) -> None:
    """Print the checksums of all motions."""
    with Robot.simulated() as robot:
        robot.home()
        robot.move_joints([0.3, 0.2, 0.9, -0.5])
        for kind, trajectory in motions(robot, random.Random(SEED), count):
            sys.stdout.write(f"{kind} {len(trajectory.times)} {checksum(trajectory)}\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT)
