"""The arm, and random scenes and joints for it."""

from __future__ import annotations

import math
import os

import numpy as np

from bioscara.kinematics import Geometry, Joints, Pose, Scara
from bioscara.planning.collision.scene import Box, Cylinder, Scene
from planning.limits import LIMITS

ARM = Scara(Geometry(0.329476, 0.285, 0.135), LIMITS, Pose(0.11908, 0.0, -0.14409))
COUNT = int(os.environ.get("BIOSCARA_RANDOM_MOVES", "45"))
"""Number of random moves and jogs that are tried."""


def random_scene(rng: np.random.Generator) -> Scene:
    zones: list[Box | Cylinder] = []
    for number in range(int(rng.integers(1, 6))):
        far, turn = rng.uniform(0.25, 0.8), rng.uniform(-math.pi, math.pi)
        x, y, low = far * math.cos(turn), far * math.sin(turn), rng.uniform(-0.1, 0.3)
        high, name = low + rng.uniform(0.01, 0.4), f"zone_{number}"
        if rng.random() < 0.5:
            zones.append(Cylinder(name, x, y, rng.uniform(0.002, 0.1), low, high))
        else:
            hx, hy = rng.uniform(0.002, 0.12, 2)
            corners = (x - hx, y - hy, low), (x + hx, y + hy, high)
            zones.append(Box(name, *corners, yaw=rng.uniform(-3.0, 3.0)))
    if rng.random() < 0.3:
        zones.append(Cylinder("cell", 0.0, 0.0, rng.uniform(0.5, 0.8), -0.1, 1.2, keep_in=True))
    return Scene(tuple(zones), 0.0, rng.choice([1e-3, 5e-3, 0.02]))


def random_joints(rng: np.random.Generator) -> Joints:
    return Joints(*(float(rng.uniform(limit.lower, limit.upper)) for limit in LIMITS))


def free_joints(rng: np.random.Generator, scene: Scene) -> Joints | None:
    """Return joints at which the arm keeps the margin, if some are found."""
    joints = [random_joints(rng) for _ in range(40)]
    free = np.flatnonzero(scene.clearance(ARM, joints) >= scene.margin)
    return joints[free[0]] if len(free) else None
