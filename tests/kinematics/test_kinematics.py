"""Laws of the closed forms: there and back, both elbows, derivatives, arrays as single poses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bioscara.errors import UnreachableError
from bioscara.kinematics import IDENTITY, Geometry, Pose, Scara, batch
from bioscara.model import load_parameters

LIMITS = load_parameters().joints
GEOMETRY = Geometry(0.329476, 0.285, 0.135)
TOOL = Pose(0.11908, 0.0, -0.14409, 0.0)
ARM = Scara(GEOMETRY, LIMITS, TOOL)

ANGLES = st.floats(-math.pi, math.pi)
PLACES = st.floats(-0.5, 0.5)
FRAMES = st.builds(Pose, PLACES, PLACES, PLACES, ANGLES)
JOINTS = st.tuples(*(st.floats(limit.lower, limit.upper) for limit in LIMITS))
ARMS = st.builds(lambda tool, base: Scara(GEOMETRY, LIMITS, tool, base), FRAMES, FRAMES)


def same_pose(one: Pose, other: Pose, within: float = 1e-9) -> bool:
    turned = math.remainder(one.yaw - other.yaw, 2.0 * math.pi)
    return max(*(abs(a - b) for a, b in zip(one[:3], other[:3], strict=True)), abs(turned)) < within


@given(ARMS, JOINTS)
def test_forward_of_inverse_is_the_pose(arm: Scara, joints: tuple[float, ...]) -> None:
    pose = arm.forward(joints)
    for way in arm.inverse(pose):
        assert same_pose(arm.forward(way), pose)


@given(ARMS, JOINTS)
def test_inverse_of_forward_contains_the_joints(arm: Scara, joints: tuple[float, ...]) -> None:
    # Stretched, the elbow's angle depends on the root of a difference: half the digits are gone.
    within = 1e-9 if abs(math.sin(joints[2])) > 1e-3 else 1e-6
    ways = arm.inverse(arm.forward(joints))

    def off(way: tuple[float, ...]) -> float:
        return max(
            abs(a - b) if i == 1 else abs(math.remainder(a - b, 2.0 * math.pi))
            for i, (a, b) in enumerate(zip(way, joints, strict=True))
        )

    assert min(map(off, ways)) < within


@given(ARMS, JOINTS)
def test_the_first_way_has_the_elbow_positive(arm: Scara, joints: tuple[float, ...]) -> None:
    first, second = arm.inverse(arm.forward(joints))
    assert first.j3 >= 0.0 >= second.j3
    assert first.j3 == -second.j3


@given(JOINTS)
def test_solve_stays_within_limits_and_near(joints: tuple[float, ...]) -> None:
    found = ARM.solve(ARM.forward(joints), joints)
    assert ARM.beyond(found) == []
    assert same_pose(ARM.forward(found), ARM.forward(joints))


@given(ARMS, JOINTS)
def test_the_jacobian_is_the_finite_difference(arm: Scara, joints: tuple[float, ...]) -> None:
    step = 1e-6
    expected = np.empty((4, 4))
    for column in range(4):
        ahead, behind = list(joints), list(joints)
        ahead[column] += step
        behind[column] -= step
        expected[:, column] = np.subtract(arm.forward(ahead), arm.forward(behind)) / (2.0 * step)
    assert np.allclose(arm.jacobian(joints), expected, atol=1e-8)


@given(ARMS, JOINTS, st.tuples(*[st.floats(-1.0, 1.0)] * 4))
def test_rates_move_the_tool_as_asked(
    arm: Scara, joints: tuple[float, ...], velocity: tuple[float, ...]
) -> None:
    if abs(math.sin(joints[2])) < 1e-6:
        return
    rates = arm.rates(joints, velocity)
    scale = max(map(abs, rates), default=1.0) + 1.0
    assert np.allclose(np.array(arm.jacobian(joints)) @ rates, velocity, atol=1e-9 * scale)
    speed = math.sqrt(sum(part * part for part in velocity[:3]))
    assert arm.tool_speed(joints, rates) == pytest.approx(speed, abs=1e-9 * scale)


@given(ARMS, st.lists(JOINTS, min_size=1, max_size=20))
def test_arrays_are_as_single_poses(arm: Scara, many: list[tuple[float, ...]]) -> None:
    q = np.array(many)
    poses = batch.forward(arm, q)
    assert np.allclose(poses, [arm.forward(row) for row in many], atol=1e-12)
    assert np.allclose(batch.jacobian(arm, q), [arm.jacobian(row) for row in many], atol=1e-12)
    ways = batch.inverse(arm, poses)
    assert ways.shape == (len(many), 2, 4)
    single = np.array([arm.inverse(Pose(*row)) for row in poses.tolist()])
    off = ways - single
    off[..., (0, 2, 3)] -= 2.0 * math.pi * np.round(off[..., (0, 2, 3)] / (2.0 * math.pi))
    assert np.abs(off).max() < 1e-6
    speeds = batch.tool_speeds(arm, q, q)
    assert np.allclose(speeds, [arm.tool_speed(row, row) for row in many], atol=1e-12)


def test_leading_axes_are_kept() -> None:
    q = np.zeros((2, 3, 4))
    assert batch.forward(ARM, q).shape == (2, 3, 4)
    assert batch.inverse(ARM, batch.forward(ARM, q)).shape == (2, 3, 2, 4)
    assert batch.jacobian(ARM, q).shape == (2, 3, 4, 4)


def test_the_tool_of_the_description() -> None:
    # x = L1 c1 + L2 c13 + 0.11908 c134, z = j2 - 0.00909, yaw = q1 + q3 + q4: the description's.
    assert ARM.forward((0.0, 0.1, 0.0, 0.0)) == pytest.approx((0.733556, 0.0, 0.09091, 0.0))


@pytest.mark.parametrize(
    ("pose", "complaint"),
    [
        (Pose(0.8, 0.0, 0.1), r"0\.0664 m beyond the reach of 0\.6145 m"),
        (Pose(0.11908, 0.0, 0.1), r"0\.0445 m inside the least distance of 0\.0445 m"),
        (Pose(350.0, 200.0, 100.0), "millimetres"),
        (Pose(math.nan, 0.0, 0.1), "not a finite pose"),
        (Pose(0.5, 0.0, 0.9), r"j2 at 0\.9091 m, 0\.5711 m beyond its range"),
    ],
)
def test_what_cannot_be_reached_is_told_with_numbers(pose: Pose, complaint: str) -> None:
    with pytest.raises(UnreachableError, match=complaint):
        ARM.solve(pose, (0.0, 0.1, 0.5, 0.0))
    if "beyond its" not in complaint:
        assert np.isnan(batch.inverse(ARM, pose)).all()


def test_stretched_it_cannot_move_so() -> None:
    with pytest.raises(UnreachableError, match="j3"):
        ARM.rates((0.0, 0.1, 0.0, 0.0), (0.1, 0.0, 0.0, 0.0))


@given(FRAMES, FRAMES)
def test_frames_compose_and_invert(one: Pose, other: Pose) -> None:
    assert same_pose(one.compose(one.inverse()), IDENTITY)
    assert same_pose(one.inverse().compose(one.compose(other)), other)
