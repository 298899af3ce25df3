"""The way to rest after a cancel or a violation."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.control.joint_trajectory.course import Course
from bioscara.control.joint_trajectory.messages import JointValues, Point


def deceleration(state: JointValues, limits: Sequence[float]) -> Course:
    """Return constant decelerations to rest, each joint by its own, from time 0 on.

    A joint at speed v ends v^2 / (2 a) further on.

    Args:
        state: Where the joints are to be at time 0, and their velocities there.
        limits: Deceleration of each [rad/s^2 or m/s^2], above zero.
    """
    joints = [
        (start, speed, abs(speed) / limit)
        for start, speed, limit in zip(state.positions, state.velocities, limits, strict=True)
    ]
    points = []
    for time in sorted({0.0, *(end for _, _, end in joints)}):
        positions, velocities = [], []
        for start, speed, end in joints:
            left = max(1.0 - time / end, 0.0) if end else 0.0
            positions.append(start + speed * end / 2.0 * (1.0 - left * left))
            velocities.append(speed * left)
        points.append(Point(time, tuple(positions), tuple(velocities)))
    return Course(points)


def standstill(positions: Sequence[float]) -> Course:
    """Return the course that stays at ``positions`` [rad or m]."""
    return Course([Point(0.0, tuple(positions))])
