"""Velocity and acceleration of the tool against differences of its poses."""

from __future__ import annotations

import numpy as np

from bioscara.kinematics import Geometry, Pose, Scara, batch
from planning.limits import LIMITS

ARM = Scara(
    Geometry(0.33, 0.285, 0.135), LIMITS, tool=Pose(0.1, 0.03, -0.1, 0.4), base=Pose(1, 2, 3, 0.7)
)


def test_velocity_and_acceleration_are_the_derivatives_of_the_pose() -> None:
    rng = np.random.default_rng(0)
    q, v, a = rng.uniform(-1.0, 1.0, (3, 50, 4))
    h = 1e-4
    before, here, after = (batch.forward(ARM, q + t * v + 0.5 * t * t * a) for t in (-h, 0.0, h))
    velocity, acceleration = batch.tool_motion(ARM, q, v, a)
    assert np.allclose(velocity, (after - before) / (2.0 * h), atol=1e-6)
    assert np.allclose(acceleration, (after - 2.0 * here + before) / h**2, atol=1e-5)
