"""Kinematics for whole arrays; the last axis is x, y, z, yaw or j1 to j4.

Every function raises :class:`~bioscara.errors.InvalidArgumentError` if the length of that axis is
not four.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from bioscara.errors import InvalidArgumentError
from bioscara.kinematics.elementary import Array, arccos, arctan2, sin_cos
from bioscara.kinematics.pose import TURN
from bioscara.kinematics.scara import LIMIT_ROUNDING, STRETCH_ROUNDING, Scara

_BLOCK = 8192
"""Poses processed at once, so that intermediate results stay in the cache."""


def forward(kinematics: Scara, joints: npt.ArrayLike) -> Array:
    """Return the poses of the tool; yaw is not wrapped.

    Args:
        kinematics: The arm.
        joints: j1 to j4 [rad, m, rad, rad], shape (..., 4).

    Returns:
        x, y, z [m] and yaw [rad], shape (..., 4).
    """
    q = _rows("joints", joints)
    l1, l2, height = kinematics.geometry
    tx, ty, tz, tyaw = kinematics.tool
    q1, q13 = q[..., 0], q[..., 0] + q[..., 2]
    yaw = q13 + q[..., 3]
    (s, c), (s1, c1), (s13, c13) = sin_cos(yaw), sin_cos(q1), sin_cos(q13)
    x = l1 * c1 + l2 * c13 + c * tx - s * ty
    y = l1 * s1 + l2 * s13 + s * tx + c * ty
    bx, by, bz, byaw = kinematics.base
    cb, sb = math.cos(byaw), math.sin(byaw)
    return np.stack(
        (
            bx + cb * x - sb * y,
            by + sb * x + cb * y,
            bz + height + q[..., 1] + tz,
            byaw + yaw + tyaw,
        ),
        axis=-1,
    )


def inverse(kinematics: Scara, poses: npt.ArrayLike) -> Array:
    """Return both solutions for each pose: elbow positive first, then elbow negative.

    No error is raised for a pose: one that is out of reach or not a number gives NaN, in both
    solutions and in all four joints. :meth:`Scara.inverse` and :meth:`Scara.solve` report the
    reason, and hint at millimetres and degrees.

    Args:
        kinematics: The arm.
        poses: x, y, z [m] and yaw [rad] of the tool, shape (..., 4).

    Returns:
        j1 to j4 [rad, m, rad, rad], shape (..., 2, 4), wrapped as
        :meth:`~bioscara.kinematics.Scara.inverse` does; limits are not checked.
    """
    p = _rows("poses", poses)
    rows = p.reshape(-1, 4)
    result = np.empty((len(rows), 2, 4))
    with np.errstate(invalid="ignore"):
        for start in range(0, len(rows), _BLOCK):
            block = slice(start, start + _BLOCK)
            _inverse_block(kinematics, rows[block], result[block])
    return result.reshape(*p.shape[:-1], 2, 4)


def _inverse_block(kinematics: Scara, poses: Array, result: Array) -> None:
    """Fill ``result`` (n, 2, 4) for ``poses`` (n, 4)."""
    to_base = kinematics.base.inverse()
    l1, l2, height = kinematics.geometry
    tx, ty, tz, tyaw = kinematics.tool
    place_x, place_y, place_z, yaw = poses.T
    turn = yaw + (to_base.yaw - tyaw)
    cb, sb = math.cos(to_base.yaw), math.sin(to_base.yaw)
    s, c = sin_cos(turn)
    x = to_base.x + cb * place_x - sb * place_y - c * tx + s * ty
    y = to_base.y + sb * place_x + cb * place_y - s * tx - c * ty
    cosine = (x * x + y * y - (l1 * l1 + l2 * l2)) / (2.0 * l1 * l2)
    size = np.abs(cosine)
    if not (size <= 1.0).all():
        cosine = np.where(size <= 1.0 + STRETCH_ROUNDING, np.clip(cosine, -1.0, 1.0), np.nan)
    q2 = place_z + (to_base.z - tz - height)
    # One NaN makes the whole solution NaN.
    cosine = cosine + 0.0 * q2
    q2 += 0.0 * cosine
    q3 = arccos(cosine)
    bearing = arctan2(y, x)
    inside = arctan2(l2 * np.sqrt((1.0 - cosine) * (1.0 + cosine)), l1 + l2 * cosine)
    for branch, sign in enumerate((1.0, -1.0)):
        solution = result[:, branch]
        q1 = _wrap(bearing - sign * inside, kinematics, 0)
        elbow = _turned(sign * q3, kinematics, 2)
        solution[:, 0], solution[:, 1], solution[:, 2] = q1, q2, elbow
        solution[:, 3] = _wrap(turn - q1 - elbow, kinematics, 3)


def jacobian(kinematics: Scara, joints: npt.ArrayLike) -> Array:
    """Return the derivatives of the poses by the joints.

    Args:
        kinematics: The arm.
        joints: j1 to j4 [rad, m, rad, rad], shape (..., 4).

    Returns:
        Rows x, y, z, yaw; columns j1 to j4; shape (..., 4, 4).
    """
    q = _rows("joints", joints)
    l1, l2, _ = kinematics.geometry
    tx, ty, _, _ = kinematics.tool
    q1 = q[..., 0] + kinematics.base.yaw
    q13 = q1 + q[..., 2]
    yaw = q13 + q[..., 3]
    (s, c), (s1, c1), (s13, c13) = sin_cos(yaw), sin_cos(q1), sin_cos(q13)
    result = np.zeros((*q.shape[:-1], 4, 4))
    result[..., 0, 3], result[..., 1, 3] = -s * tx - c * ty, c * tx - s * ty
    result[..., 0, 2] = result[..., 0, 3] - l2 * s13
    result[..., 1, 2] = result[..., 1, 3] + l2 * c13
    result[..., 0, 0] = result[..., 0, 2] - l1 * s1
    result[..., 1, 0] = result[..., 1, 2] + l1 * c1
    result[..., 2, 1] = 1.0
    result[..., 3, (0, 2, 3)] = 1.0
    return result


def tool_speeds(kinematics: Scara, joints: npt.ArrayLike, rates: npt.ArrayLike) -> Array:
    """Return the speed as :meth:`Scara.tool_speed` does [m/s], shape (...).

    Args:
        kinematics: The arm.
        joints: Positions of the joints [rad, m, rad, rad], shape (..., 4).
        rates: Velocities of the joints [rad/s, m/s, rad/s, rad/s], shape (..., 4).
    """
    q, v = _rows("joints", joints), _rows("rates", rates)
    l1, l2, _ = kinematics.geometry
    tx, ty, _, _ = kinematics.tool
    # In the forearm's frame: the speed does not depend on its orientation.
    q3, q4 = q[..., 2], q[..., 3]
    (s3, c3), (s, c) = sin_cos(q3), sin_cos(q4)
    r1 = l1 * v[..., 0]
    r13 = v[..., 0] + v[..., 2]
    r4 = r13 + v[..., 3]
    along = r1 * s3 - r4 * (tx * s + ty * c)
    across = r1 * c3 + l2 * r13 + r4 * (tx * c - ty * s)
    level = along * along + across * across
    if kinematics.overhang:
        level = (np.sqrt(level) + kinematics.overhang * np.abs(r4)) ** 2
    return np.asarray(np.sqrt(level + v[..., 1] ** 2))


def tool_motion(
    kinematics: Scara, joints: npt.ArrayLike, rates: npt.ArrayLike, accelerations: npt.ArrayLike
) -> tuple[Array, Array]:
    """Return velocity and acceleration of the tool.

    Args:
        kinematics: The arm.
        joints: Positions of the joints [rad, m, rad, rad], shape (..., 4).
        rates: Velocities of the joints [rad/s, m/s, rad/s, rad/s], shape (..., 4).
        accelerations: Of the joints [rad/s^2, m/s^2, rad/s^2, rad/s^2], shape (..., 4).

    Returns:
        First and second time derivatives of x, y, z [m] and yaw [rad], shape (..., 4).
    """
    q, v = _rows("joints", joints), _rows("rates", rates)
    a = _rows("accelerations", accelerations)
    # Of upper arm, forearm and tool.
    along = (kinematics.geometry.upper_arm, kinematics.geometry.forearm, kinematics.tool.x)
    aside = (0.0, 0.0, kinematics.tool.y)
    angles, rates, gains = (np.cumsum(part[..., (0, 2, 3)], axis=-1) for part in (q, v, a))
    s, c = sin_cos(angles + kinematics.base.yaw)
    x, y = c * along - s * aside, s * along + c * aside
    inward = rates * rates
    return (
        np.stack(
            (-(rates * y).sum(axis=-1), (rates * x).sum(axis=-1), v[..., 1], rates[..., 2]), axis=-1
        ),
        np.stack(
            (
                -(inward * x + gains * y).sum(axis=-1),
                (gains * x - inward * y).sum(axis=-1),
                a[..., 1],
                gains[..., 2],
            ),
            axis=-1,
        ),
    )


def _wrap(angles: Array, kinematics: Scara, joint: int) -> Array:
    # Half a turn gives +pi, as in Scara.
    return _turned(angles - TURN * np.ceil(angles * (1.0 / TURN) - 0.5), kinematics, joint)


def _turned(angles: Array, kinematics: Scara, joint: int) -> Array:
    """Return angles within half a turn, or on another turn where only that is within limits."""
    slack = 0.5 * LIMIT_ROUNDING
    lower, upper = kinematics.limits[joint].lower - slack, kinematics.limits[joint].upper + slack
    # For limits within half a turn of zero, no other turn of the angle is within them.
    if lower > -math.pi and upper < math.pi:
        return angles
    up = angles + TURN * np.ceil((lower - angles) / TURN)
    down = angles - TURN * np.ceil((angles - upper) / TURN)
    angles = np.where((angles < lower) & (up <= upper), up, angles)
    return np.where((angles > upper) & (down >= lower), down, angles)


def _rows(what: str, values: npt.ArrayLike) -> Array:
    """Return values as an array whose last axis has length four."""
    rows = np.asarray(values, dtype=np.float64)
    if rows.shape[-1:] != (4,):
        raise InvalidArgumentError(f"{what} have the shape {rows.shape}; it must be (..., 4)")
    return rows
