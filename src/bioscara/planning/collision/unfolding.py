"""Motions from and to the folded position: the elbow alone, the other joints while it is open.

Homing leaves the arm folded up, with the hand next to the column. From there a joint that moves
together with the elbow can drive a jaw into the column, whereas the elbow alone moves the hand
straight away from it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bioscara.kinematics import Joints
from bioscara.planning.trajectory.trajectory import Trajectory

OPEN = math.pi / 2.0
"""Angle of the elbow [rad] up to which the gripper reaches neither column nor base, at any width of
it and any positions of lift and other joints; on the meshes of the arm it is 1.75 rad."""


def by_open_elbow(start: Sequence[float], goal: Sequence[float]) -> list[Joints]:
    """Return the joint positions of a motion that opens the elbow before the other joints move.

    Args:
        start: Present positions of the joints [rad, m, rad, rad].
        goal: Their goal.

    Returns:
        Start, goal and the positions between them; fewer than three positions if the elbow is open
        at both, because then only the direct path is possible.
    """
    begin, end = Joints(*start), Joints(*goal)
    places = [begin]
    if abs(begin.j3) > OPEN:
        places.append(begin._replace(j3=0.0))
    if abs(end.j3) > OPEN:
        places.append(end._replace(j3=0.0))
    return [*places, end]


def joined(legs: Sequence[Trajectory]) -> Trajectory:
    """Join point-to-point motions into one trajectory, at rest between them.

    Args:
        legs: Motions of the same joints; each begins where the one before ends.
    """
    moving = [leg for leg in legs if leg.duration > 0.0]
    if not moving:
        return legs[0]
    times, positions, velocities, cubics = [np.zeros(1)], [], [], []
    for leg in moving:
        # The point that two legs share is taken from the later one.
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
