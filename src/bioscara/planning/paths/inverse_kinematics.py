"""The joints along a path of the tool, with their derivatives by the path parameter.

With the wrist's axis at w = L1 e1 + L2 e13 (e1 and e13 are the directions of upper arm and
forearm), the dot product of its derivative with the direction of one link leaves only the rate of
the *other* as unknown:

    q1' = w'.e13 / (L1 sin q3),   q13' = -w'.e1 / (L2 sin q3)

and the second derivatives likewise, of w'' + L1 q1'^2 e1 + L2 q13'^2 e13.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bioscara.kinematics import Joints, Scara
from bioscara.kinematics.elementary import arccos, arctan2, sin_cos
from bioscara.kinematics.pose import TURN
from bioscara.planning.arrays import Array
from bioscara.planning.paths.segments import PathSamples


class JointSamples(NamedTuple):
    """The joints at some parameters of a path; NaN or infinite where the arm cannot reach it.

    Attributes:
        joints: j1 to j4 [rad, m, rad, rad], shape (n, 4).
        first: Their derivatives by the path parameter.
        second: Their second derivatives by the path parameter.
    """

    joints: Array
    first: Array
    second: Array


def along(kinematics: Scara, samples: PathSamples, start: Joints) -> JointSamples:
    """Return the joints on the elbow's side of ``start``, continuous from there.

    Args:
        kinematics: The arm.
        samples: The path.
        start: The joints at the first sample; the others follow without jumps by a full turn.
    """
    side = 1.0 if math.sin(start.j3) >= 0.0 else -1.0
    # An elbow that moves past half a turn bends to the other side.
    elbow_turn = TURN * round((start.j3 - side * math.pi / 2.0) / TURN)
    l1, l2, height = kinematics.geometry
    to_base = kinematics.base.inverse()
    turn = samples.poses[:, 3] + (to_base.yaw - kinematics.tool.yaw)
    (x, y), (x1, y1), (x2, y2) = _wrist(kinematics, samples, turn)
    with np.errstate(all="ignore"):
        cosine = (x * x + y * y - (l1 * l1 + l2 * l2)) / (2.0 * l1 * l2)
        cosine = np.where(np.abs(cosine) <= 1.0 + 1e-12, np.clip(cosine, -1.0, 1.0), np.nan)
        q3 = elbow_turn + side * arccos(cosine)
        sine, _ = sin_cos(q3)
        q1 = arctan2(y, x) - arctan2(l2 * sine, l1 + l2 * cosine)
        q1 = start.j1 + _unwrapped(q1 - start.j1)
        q13 = q1 + q3
        (s1, c1), (s13, c13) = sin_cos(q1), sin_cos(q13)
        r1, r13 = (x1 * c13 + y1 * s13) / (l1 * sine), -(x1 * c1 + y1 * s1) / (l2 * sine)
        bend1, bend13 = l1 * r1 * r1, l2 * r13 * r13
        x2, y2 = x2 + bend1 * c1 + bend13 * c13, y2 + bend1 * s1 + bend13 * s13
        a1, a13 = (x2 * c13 + y2 * s13) / (l1 * sine), -(x2 * c1 + y2 * s1) / (l2 * sine)
    q4 = turn - q13
    q4 += 2.0 * math.pi * np.round((start.j4 - q4[0]) / (2.0 * math.pi)) if len(q4) else 0.0
    q2 = samples.poses[:, 2] + (to_base.z - kinematics.tool.z - height)
    yaw1, yaw2 = samples.first[:, 3], samples.second[:, 3]
    return JointSamples(
        np.stack((q1, q2, q3, q4), axis=1),
        np.stack((r1, samples.first[:, 2], r13 - r1, yaw1 - r13), axis=1),
        np.stack((a1, samples.second[:, 2], a13 - a1, yaw2 - a13), axis=1),
    )


def _wrist(kinematics: Scara, samples: PathSamples, turn: Array) -> tuple[tuple[Array, Array], ...]:
    """Return x and y of the wrist's axis in the arm's base, and their derivatives."""
    to_base, tool = kinematics.base.inverse(), kinematics.tool
    cb, sb = math.cos(to_base.yaw), math.sin(to_base.yaw)
    places = [
        (cb * part[:, 0] - sb * part[:, 1], sb * part[:, 0] + cb * part[:, 1]) for part in samples
    ]
    (x, y), (x1, y1), (x2, y2) = places
    s, c = sin_cos(turn)
    tool_x, tool_y = c * tool.x - s * tool.y, s * tool.x + c * tool.y
    yaw1, yaw2 = samples.first[:, 3], samples.second[:, 3]
    inward = yaw1 * yaw1
    return (
        (x + to_base.x - tool_x, y + to_base.y - tool_y),
        (x1 + yaw1 * tool_y, y1 - yaw1 * tool_x),
        (x2 + yaw2 * tool_y + inward * tool_x, y2 - yaw2 * tool_x + inward * tool_y),
    )


def _unwrapped(angles: Array) -> Array:
    """Return angles without jumps by a full turn, the first one nearest to zero."""
    if not len(angles):
        return angles
    first = angles[0] - 2.0 * math.pi * np.round(angles[0] / (2.0 * math.pi))
    steps = np.diff(angles)
    steps -= 2.0 * math.pi * np.round(steps / (2.0 * math.pi))
    return np.concatenate(([first], first + np.cumsum(steps)))
