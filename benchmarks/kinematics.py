"""Inverse kinematics: the closed forms against pinocchio's numeric solver."""

from __future__ import annotations

import itertools
import math
import statistics
from collections.abc import Callable
from importlib.util import find_spec

import numpy as np

from benchmarks.measure import Row, at_most, medians, timed
from bioscara.kinematics import Pose, Scara, batch
from bioscara.model import load_parameters
from bioscara.model.urdf import URDF
from bioscara.robot import kinematics_of

POSES = 10_000
ALL_AT_ONCE = 1_000_000


def _joints(kinematics: Scara, count: int) -> np.ndarray:
    """Return random joints within the limits; elbow not within 6 degrees of stretched."""
    rng = np.random.default_rng(0)
    lower = [limit.lower for limit in kinematics.limits]
    upper = [limit.upper for limit in kinematics.limits]
    joints = rng.uniform(lower, upper, (count, 4))
    joints[:, 2] = rng.choice((-1.0, 1.0), count) * rng.uniform(0.1, upper[2], count)
    return joints


def _round_trip(kinematics: Scara, joints: np.ndarray) -> float:
    """Return the largest error of a pose [m, rad] or of joints [rad, m], there and back."""
    poses = batch.forward(kinematics, joints)
    ways = batch.inverse(kinematics, poses)
    there = batch.forward(kinematics, ways) - poses[:, None, :]
    there[..., 3] -= 2.0 * math.pi * np.round(there[..., 3] / (2.0 * math.pi))
    back = ways - joints[:, None, :]
    turning = (0, 2, 3)
    back[..., turning] -= 2.0 * math.pi * np.round(back[..., turning] / (2.0 * math.pi))
    return float(max(np.abs(there).max(), np.abs(back).max(axis=-1).min(axis=-1).max()))


def _single(kinematics: Scara, poses: np.ndarray) -> Callable[[], object]:
    """Return a function that solves one pose after the other."""
    each = itertools.cycle([Pose(*row) for row in poses[:1000].tolist()])
    return lambda: kinematics.inverse(next(each))


def _trigonometry() -> Callable[[], object]:
    """Return the functions of an angle that two elbows need, in plain floats."""

    def run(a: float = 0.3, b: float = 0.4) -> tuple[float, ...]:
        distance, elbow = math.hypot(a, b), math.acos(a)
        return distance, elbow, math.atan2(a, b), math.atan2(b, distance), math.sin(elbow)

    return run


def _pinocchio(
    kinematics: Scara, joints: np.ndarray, single: Callable[[], object]
) -> tuple[float, float, float]:
    """Return the times of a numeric solution to 1e-9 and of ours [s], and the share that it found.

    The damped least squares of pinocchio's own example, from the middle of the limits, with half
    steps: whole ones take half the time and miss one goal in twenty, those of the example (a
    tenth) take six times as long.
    """
    import pinocchio  # noqa: PLC0415

    full = pinocchio.buildModelFromUrdf(str(URDF))
    names = [limit.name for limit in kinematics.limits]
    others = [full.getJointId(name) for name in list(full.names)[1:] if name not in names]
    model = pinocchio.buildReducedModel(full, others, pinocchio.neutral(full))
    data, last = model.createData(), model.getJointId(names[-1])
    start = 0.5 * (model.lowerPositionLimit + model.upperPositionLimit)

    def solve(goal: pinocchio.SE3) -> bool:
        q = start
        for _ in range(100):
            pinocchio.forwardKinematics(model, data, q)
            off = data.oMi[last].actInv(goal)
            error = pinocchio.log(off).vector
            if np.linalg.norm(error) < 1e-9:
                return True
            slope = -pinocchio.Jlog6(off.inverse())
            slope = slope @ pinocchio.computeJointJacobian(model, data, q, last)
            v = -slope.T @ np.linalg.solve(slope @ slope.T + 1e-6 * np.eye(6), error)
            q = pinocchio.integrate(model, q, 0.5 * v)
        return False

    goals = []
    for row in joints[:200]:
        pinocchio.forwardKinematics(model, data, row)
        goals.append(data.oMi[last].copy())
    found = sum(map(solve, goals)) / len(goals)
    turns = [(timed(lambda g=goal: solve(g)), timed(single, 50)) for goal in goals]
    peer, own = (statistics.mean(column) for column in zip(*turns, strict=True))
    return peer, own, found


def rows() -> list[Row]:
    """Measure single poses, whole arrays, and the round trip."""
    arm = kinematics_of(load_parameters())
    joints = _joints(arm, ALL_AT_ONCE)
    poses = batch.forward(arm, joints)
    single = _single(arm, poses)
    own, floor = medians(single, _trigonometry(), number=2000)
    whose = "five functions of angles, plain floats"
    result = [at_most("inverse, one pose, both elbows", own, 30, floor, whose)]
    if find_spec("pinocchio") is None:
        result.append(Row("the same", "-", "pinocchio is not installed", "skipped", holds=True))
    else:
        peer, own, found = _pinocchio(arm, joints, single)
        result.append(
            Row(
                "the same",
                f"{peer / own:.0f} times as fast",
                f"pinocchio, damped least squares to 1e-9, {100 * found:.0f} % found: "
                f"{1e6 * peer:.0f} us",
                "at least 100 times",
                peer >= 100.0 * own,
            )
        )
    for count in (POSES, ALL_AT_ONCE):
        some = poses[:count]
        whole, one = medians(
            lambda some=some: batch.inverse(arm, some), single, rounds=9, number=(1, 2000)
        )
        result.append(
            Row(
                f"inverse, array of {count} poses, both elbows",
                f"{1e-6 * count / whole:.1f} million/s ({one * count / whole:.0f} times)",
                f"one by one: {1e-6 / one:.2f} million/s",
                "at least 15 times",
                one * count >= 15.0 * whole,
            )
        )
    error = _round_trip(arm, joints)
    result.append(
        Row(
            f"there and back, {ALL_AT_ONCE} joint positions",
            f"{error:.1e} m or rad at most",
            "double precision",
            "at most 1e-9",
            error <= 1e-9,
        )
    )
    return result
