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
    w, w1, w2 = _wrist(kinematics, samples, turn)
    with np.errstate(all="ignore"):
        cosine = ((w * w.conj()).real - (l1 * l1 + l2 * l2)) / (2.0 * l1 * l2)
        cosine = np.where(np.abs(cosine) <= 1.0 + 1e-12, np.clip(cosine, -1.0, 1.0), np.nan)
        q3 = elbow_turn + side * np.arccos(cosine)
        q1 = np.angle(w) - np.arctan2(l2 * np.sin(q3), l1 + l2 * cosine)
        q1 = start.j1 + _unwrapped(q1 - start.j1)
        q13 = q1 + q3
        e1, e13 = np.exp(1j * q1), np.exp(1j * q13)
        sine = np.sin(q3)
        r1, r13 = _dot(w1, e13) / (l1 * sine), -_dot(w1, e1) / (l2 * sine)
        rest = w2 + l1 * r1 * r1 * e1 + l2 * r13 * r13 * e13
        a1, a13 = _dot(rest, e13) / (l1 * sine), -_dot(rest, e1) / (l2 * sine)
    q4 = turn - q13
    q4 += 2.0 * math.pi * np.round((start.j4 - q4[0]) / (2.0 * math.pi)) if len(q4) else 0.0
    q2 = samples.poses[:, 2] + (to_base.z - kinematics.tool.z - height)
    yaw1, yaw2 = samples.first[:, 3], samples.second[:, 3]
    return JointSamples(
        np.stack((q1, q2, q3, q4), axis=1),
        np.stack((r1, samples.first[:, 2], r13 - r1, yaw1 - r13), axis=1),
        np.stack((a1, samples.second[:, 2], a13 - a1, yaw2 - a13), axis=1),
    )


def _wrist(kinematics: Scara, samples: PathSamples, turn: Array) -> tuple[Array, Array, Array]:
    """Return position and derivatives of the wrist's axis in the arm's base, as complex numbers."""
    to_base = kinematics.base.inverse()
    rotation = complex(math.cos(to_base.yaw), math.sin(to_base.yaw))
    p, p1, p2 = (rotation * (part[:, 0] + 1j * part[:, 1]) for part in samples)
    arm_of_tool = np.exp(1j * turn) * complex(kinematics.tool.x, kinematics.tool.y)
    yaw1, yaw2 = samples.first[:, 3], samples.second[:, 3]
    return (
        p + complex(to_base.x, to_base.y) - arm_of_tool,
        p1 - 1j * yaw1 * arm_of_tool,
        p2 - (1j * yaw2 - yaw1 * yaw1) * arm_of_tool,
    )


def _dot(a: Array, b: Array) -> Array:
    return a.real * b.real + a.imag * b.imag


def _unwrapped(angles: Array) -> Array:
    """Return angles without jumps by a full turn, the first one nearest to zero."""
    if not len(angles):
        return angles
    first = angles[0] - 2.0 * math.pi * np.round(angles[0] / (2.0 * math.pi))
    steps = np.diff(angles)
    steps -= 2.0 * math.pi * np.round(steps / (2.0 * math.pi))
    return np.concatenate(([first], first + np.cumsum(steps)))
