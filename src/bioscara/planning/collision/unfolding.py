"""The way out of a folded arm and into it: the elbow alone, the others while it is open.

Homing leaves the arm folded up, with the hand beside the column. From there a joint that turns
together with the elbow can lead a jaw into the column, while the elbow alone leads the hand
straight away from it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bioscara.kinematics import Joints
from bioscara.planning.trajectory.trajectory import Trajectory

OPEN = math.pi / 2.0
"""Angle of the elbow [rad] up to which the gripper reaches neither column nor base, whatever the
other joints, its width and the lift; on the meshes of the arm it is 1.75 rad."""


def by_open_elbow(start: Sequence[float], goal: Sequence[float]) -> list[Joints]:
    """Return the places between which an arm moves that opens its elbow before it turns.

    Args:
        start: Where the joints are [rad, m, rad, rad].
        goal: Where they go.

    Returns:
        Start and goal with what is between them: fewer than three places where the elbow is open at
        both, so that there is no other way than the direct one.
    """
    begin, end = Joints(*start), Joints(*goal)
    places = [begin]
    if abs(begin.j3) > OPEN:
        places.append(begin._replace(j3=0.0))
    if abs(end.j3) > OPEN:
        places.append(end._replace(j3=0.0))
    return [*places, end]


def joined(legs: Sequence[Trajectory]) -> Trajectory:
    """Return point-to-point motions as one that rests between them.

    Args:
        legs: Of the same joints; each begins where the one before ends.
    """
    moving = [leg for leg in legs if leg.duration > 0.0]
    if not moving:
        return legs[0]
    times, positions, velocities, cubics = [np.zeros(1)], [], [], []
    for leg in moving:
        # Where two legs meet, the point is that of the later one.
        times.append(times[-1][-1] + leg.times[1:])
        positions.append(leg.positions if leg is moving[-1] else leg.positions[:-1])
        rates = np.zeros_like(leg.positions) if leg.velocities is None else leg.velocities
        velocities.append(rates if leg is moving[-1] else rates[:-1])
        cubics.append(leg.coefficients[..., 2:4])
    return Trajectory(
        moving[0].joint_names,
        np.concatenate(times),
        np.concatenate(positions),
        np.concatenate(velocities),
        cubics=np.concatenate(cubics),
    )
