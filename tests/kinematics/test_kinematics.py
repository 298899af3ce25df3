"""Invariants of the kinematics: inverse of forward, both elbows, derivatives, batches."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from bioscara.errors import InvalidArgumentError, UnreachableError
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
def test_forward_of_inverse_is_the_pose(kinematics: Scara, joints: tuple[float, ...]) -> None:
    pose = kinematics.forward(joints)
    for way in kinematics.inverse(pose):
        assert same_pose(kinematics.forward(way), pose)


@given(ARMS, JOINTS)
def test_inverse_of_forward_contains_the_joints(
    kinematics: Scara, joints: tuple[float, ...]
) -> None:
    # Stretched, the elbow's angle depends on the root of a difference: half the digits are gone.
    within = 1e-9 if abs(math.sin(joints[2])) > 1e-3 else 1e-6
    ways = kinematics.inverse(kinematics.forward(joints))

    def off(way: tuple[float, ...]) -> float:
        return max(
            abs(a - b) if i == 1 else abs(math.remainder(a - b, 2.0 * math.pi))
            for i, (a, b) in enumerate(zip(way, joints, strict=True))
        )

    assert min(map(off, ways)) < within


@given(ARMS, JOINTS)
def test_the_first_solution_has_the_elbow_positive(
    kinematics: Scara, joints: tuple[float, ...]
) -> None:
    first, second = kinematics.inverse(kinematics.forward(joints))
    assert first.j3 >= 0.0 >= second.j3
    assert first.j3 == -second.j3


@given(JOINTS)
def test_solve_stays_within_limits_and_near(joints: tuple[float, ...]) -> None:
    found = ARM.solve(ARM.forward(joints), joints)
    assert ARM.beyond(found) == []
    assert same_pose(ARM.forward(found), ARM.forward(joints))


@given(ARMS, JOINTS)
def test_the_jacobian_is_the_finite_difference(
    kinematics: Scara, joints: tuple[float, ...]
) -> None:
    step = 1e-6
    expected = np.empty((4, 4))
    for column in range(4):
        ahead, behind = list(joints), list(joints)
        ahead[column] += step
        behind[column] -= step
        expected[:, column] = np.subtract(kinematics.forward(ahead), kinematics.forward(behind)) / (
            2.0 * step
        )
    assert np.allclose(kinematics.jacobian(joints), expected, atol=1e-8)


@given(ARMS, JOINTS, st.tuples(*[st.floats(-1.0, 1.0)] * 4))
def test_rates_move_the_tool_at_the_requested_velocity(
    kinematics: Scara, joints: tuple[float, ...], velocity: tuple[float, ...]
) -> None:
    if abs(math.sin(joints[2])) < 1e-6:
        return
    rates = kinematics.rates(joints, velocity)
    scale = max(map(abs, rates), default=1.0) + 1.0
    assert np.allclose(np.array(kinematics.jacobian(joints)) @ rates, velocity, atol=1e-9 * scale)
    speed = math.sqrt(sum(part * part for part in velocity[:3]))
    assert kinematics.tool_speed(joints, rates) == pytest.approx(speed, abs=1e-9 * scale)


@given(ARMS, st.lists(JOINTS, min_size=1, max_size=20))
def test_arrays_are_as_single_poses(kinematics: Scara, many: list[tuple[float, ...]]) -> None:
    q = np.array(many)
    poses = batch.forward(kinematics, q)
    assert np.allclose(poses, [kinematics.forward(row) for row in many], atol=1e-12)
    assert np.allclose(
        batch.jacobian(kinematics, q), [kinematics.jacobian(row) for row in many], atol=1e-12
    )
    ways = batch.inverse(kinematics, poses)
    assert ways.shape == (len(many), 2, 4)
    single = np.array([kinematics.inverse(Pose(*row)) for row in poses.tolist()])
    off = ways - single
    off[..., (0, 2, 3)] -= 2.0 * math.pi * np.round(off[..., (0, 2, 3)] / (2.0 * math.pi))
    assert np.abs(off).max() < 1e-6
    speeds = batch.tool_speeds(kinematics, q, q)
    assert np.allclose(speeds, [kinematics.tool_speed(row, row) for row in many], atol=1e-12)


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
        (Pose(0.35, 0.2, 100.0), "j2 at 100.* millimetres"),
        (Pose(0.5, 0.0, 0.9), r"j2 at 0\.9091 m, 0\.5711 m beyond its range"),
        (Pose(0.45, -0.2, 0.1, 90.0), r"yaw 90 rad .* are these degrees\?"),
        (Pose(0.45, -0.2, 0.1, -1e300), r"are these degrees\?"),
    ],
)
def test_a_pose_out_of_reach_is_reported_with_the_excess(pose: Pose, complaint: str) -> None:
    with pytest.raises(UnreachableError, match=complaint):
        ARM.solve(pose, (0.0, 0.1, 0.5, 0.0))
    if "j2" not in complaint and not abs(pose.yaw):
        assert np.isnan(batch.inverse(ARM, pose)).all()


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_start_that_is_not_finite_is_refused(value: float) -> None:
    with pytest.raises(InvalidArgumentError, match="not a finite number"):
        ARM.solve(Pose(0.4, 0.2, 0.1), (0.0, 0.1, value, 0.0))


@pytest.mark.parametrize("field", range(4))
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    "kinematics", [ARM, Scara(GEOMETRY, LIMITS, IDENTITY, Pose(1.0, 0.0, 0.0, 1.0))]
)
def test_a_pose_that_is_not_finite_is_refused(kinematics: Scara, field: int, value: float) -> None:
    pose = Pose(*(value if i == field else 0.2 for i in range(4)))
    with pytest.raises(InvalidArgumentError, match="not a finite number"):
        kinematics.inverse(pose)
    assert np.isnan(batch.inverse(kinematics, pose)).all()


@given(FRAMES, FRAMES, st.one_of(st.floats(1e-6, 1e-3), st.floats(1e-3, 3.0)), ANGLES)
def test_too_far_and_too_close_are_reported_with_the_excess(
    tool: Pose, base: Pose, off: float, bearing: float
) -> None:
    """The message states the distance by which the wrist's axis is out of reach, in any frames."""
    arm = Scara(GEOMETRY, LIMITS, tool, base)
    inner, outer = GEOMETRY.upper_arm - GEOMETRY.forearm, GEOMETRY.upper_arm + GEOMETRY.forearm
    wrists = [(outer + off, off, "beyond")]
    if off < inner:
        wrists.append((inner - off, off, "inside"))
    for radius, by, word in wrists:
        wrist = Pose(radius * math.cos(bearing), radius * math.sin(bearing), 0.2, bearing)
        pose = base.compose(wrist.compose(tool))
        with pytest.raises(UnreachableError, match=word) as caught:
            arm.inverse(pose)
        (told,) = re.findall(rf"be (\S+) m {word}", str(caught.value))
        assert float(told) == pytest.approx(by, rel=0.06, abs=0.0 if by < 0.9e-3 else 6e-5)
        assert np.isnan(batch.inverse(arm, pose)).all()


@given(JOINTS, st.sampled_from(range(4)), st.floats(0.01, 0.05))
def test_out_of_limits_is_reported_with_joint_and_excess(
    joints: tuple[float, ...], joint: int, over: float
) -> None:
    beyond = list(joints)
    beyond[joint] = LIMITS[joint].upper + over
    (sentence,) = ARM.beyond(beyond)
    limit = LIMITS[joint]
    assert sentence.startswith(f"{limit.name} at {beyond[joint]:.4f} {limit.unit}, {over:.4f} ")
    assert f"{limit.lower:g} .. {limit.upper:g}" in sentence


@pytest.mark.parametrize(
    ("joint", "value", "told"),
    [
        (0, 90.0, "are these degrees"),
        (1, 200.0, "are these millimetres"),
        (1, LIMITS[1].upper + 2.1e-6, r"2\.1e-06 m beyond"),
        (2, LIMITS[2].lower - 3e-9, r"3e-09 rad beyond"),
    ],
)
def test_joints_beyond_limits_are_reported_with_units_and_small_excesses(
    joint: int, value: float, told: str
) -> None:
    joints = [0.0, 0.1, 0.5, 0.0]
    joints[joint] = value
    (sentence,) = ARM.beyond(joints)
    assert re.search(told, sentence), sentence


def test_an_excess_of_both_solutions_is_reported_once() -> None:
    with pytest.raises(UnreachableError) as caught:
        ARM.solve(Pose(0.5, 0.1, 0.9), (0.0, 0.1, 0.5, 0.0))
    assert str(caught.value).count("beyond its range") == 1


@pytest.mark.parametrize("value", [(0.5, 0.0, 0.2), (0.5, 0.0, 0.2, 0.0), [0.5, 0.0, 0.2, 0.0]])
def test_a_value_that_is_no_pose_is_refused(value: Any) -> None:
    with pytest.raises(InvalidArgumentError, match=r"give Pose\(x, y, z, yaw\)"):
        ARM.solve(value, (0.0, 0.1, 0.5, 0.0))


def test_a_yaw_of_more_turns_than_degrees_would_have_is_one_where_the_joints_have_them() -> None:
    arm = Scara(GEOMETRY, with_range(9.0, 0, 3))
    joints = (8.5, 0.1, 0.6, 8.5)
    assert arm.solve(arm.forward(joints), joints) == pytest.approx(joints)


def test_both_solutions_out_of_limits_are_both_reported() -> None:
    # Straight behind the column's end stops, with the gripper turned back: out of reach with either
    # elbow.
    arm = Scara(GEOMETRY, with_range(1.0, 0, 3))
    with pytest.raises(UnreachableError, match=r"j1 at .* beyond its range -1 \.\. 1.* or j1 at"):
        arm.solve(Pose(-0.5, 0.0, 0.3, math.pi), (0.0, 0.1, 0.5, 0.0))


@pytest.mark.parametrize("elbow", [0.0, math.pi, -math.pi, 1e-12])
def test_on_a_stretched_or_folded_arm_rates_are_refused(elbow: float) -> None:
    with pytest.raises(UnreachableError, match=r"j3 .* rad from stretched or folded"):
        ARM.rates((0.0, 0.1, elbow, 0.0), (0.1, 0.0, 0.0, 0.0))


@dataclasses.dataclass(frozen=True)
class Span:
    name: str
    unit: str
    lower: float
    upper: float


def with_range(half: float, *indices: int, centre: float = 0.0) -> list[Span]:
    """The arm's limits, but these joints have ``half`` on both sides of ``centre``."""
    return [
        Span(limit.name, limit.unit, centre - half, centre + half)
        if index in indices
        else Span(limit.name, limit.unit, limit.lower, limit.upper)
        for index, limit in enumerate(LIMITS)
    ]


RANGES = st.tuples(st.floats(0.3, 12.0), st.floats(-10.0, 10.0))


@given(FRAMES, FRAMES, RANGES, RANGES, RANGES, st.tuples(*[st.floats(0.0, 1.0)] * 4))
def test_joints_with_any_range_of_turns(
    tool: Pose,
    base: Pose,
    column: tuple[float, float],
    elbow: tuple[float, float],
    wrist: tuple[float, float],
    at: tuple[float, ...],
) -> None:
    """For any range, joints within it are found again, on their turn."""
    spans = with_range(10.0)
    for joint, (half, centre) in zip((0, 2, 3), (column, elbow, wrist), strict=True):
        spans[joint] = with_range(half, joint, centre=centre)[joint]
    arm = Scara(GEOMETRY, spans, tool, base)
    joints = tuple(s.lower + part * (s.upper - s.lower) for s, part in zip(spans, at, strict=True))
    stretched = abs(math.sin(joints[2])) < 1e-3
    # There an angle has half the digits, which may be just beyond its limit.
    assume(not stretched or all(1e-6 < part < 1.0 - 1e-6 for part in at))
    pose = arm.forward(joints)
    found = arm.solve(pose, joints)
    assert arm.beyond(found) == []
    assert same_pose(arm.forward(found), pose)
    assert max(abs(a - b) for a, b in zip(found, joints, strict=True)) < 1e-5 or (
        stretched  # there the other elbow may be as near
    )
    one, many = np.array(arm.inverse(pose)), batch.inverse(arm, pose)
    off = one - many
    off[:, (0, 2, 3)] -= 2.0 * math.pi * np.round(off[:, (0, 2, 3)] / (2.0 * math.pi))
    assert np.abs(off).max() < 1e-6
    ways = [arm.beyond(way) for way in arm.inverse(pose)]
    assert any(not way for way in ways)
    assert not all(arm.beyond(way) for way in many.tolist())


@given(JOINTS, st.tuples(*[st.integers(-1, 1)] * 2))
def test_a_wrist_of_three_turns_stays_on_its_turn(
    joints: tuple[float, ...], turns: tuple[int, int]
) -> None:
    arm = Scara(GEOMETRY, with_range(3.0 * math.pi, 0, 3), TOOL)
    q1, q2, q3, q4 = joints
    near = (q1 + 2.0 * math.pi * turns[0], q2, q3, q4 + 2.0 * math.pi * turns[1])
    if all(abs(angle) < 3.0 * math.pi - 0.01 for angle in near) and abs(math.sin(q3)) > 1e-3:
        assert arm.solve(arm.forward(joints), near) == pytest.approx(near, abs=1e-9)


def test_whole_arrays_longer_than_a_block_keep_their_order() -> None:
    rng = np.random.default_rng(4)
    q = rng.uniform([s.lower for s in LIMITS], [s.upper for s in LIMITS], (20_001, 4))
    poses = batch.forward(ARM, q)
    ways = batch.inverse(ARM, poses)
    back = batch.forward(ARM, ways) - poses[:, None, :]
    back[..., 3] -= 2.0 * math.pi * np.round(back[..., 3] / (2.0 * math.pi))
    assert np.abs(back).max() < 1e-9


def test_half_a_turn_is_the_positive_one_also_in_arrays() -> None:
    arm = Scara(Geometry(0.25, 0.25, 0.1), LIMITS)
    pose = Pose(0.5, 0.0, 0.2, -math.pi)
    assert [way.j4 for way in arm.inverse(pose)] == [math.pi, math.pi]
    assert batch.inverse(arm, pose)[:, 3].tolist() == [math.pi, math.pi]


@pytest.mark.parametrize("shape", [(), (0,), (3,), (5,), (8,), (7, 5), (4, 3), (4, 0)])
def test_arrays_without_four_values_a_row_are_refused(shape: tuple[int, ...]) -> None:
    values = np.zeros(shape)
    calls: list[Callable[[], object]] = [
        lambda: batch.forward(ARM, values),
        lambda: batch.inverse(ARM, values),
        lambda: batch.jacobian(ARM, values),
        lambda: batch.tool_speeds(ARM, values, np.zeros(4)),
        lambda: batch.tool_speeds(ARM, np.zeros(4), values),
        lambda: batch.tool_motion(ARM, np.zeros(4), values, np.zeros(4)),
    ]
    for call in calls:
        with pytest.raises(InvalidArgumentError, match=re.escape(f"{shape}") + r".* \(\.\.\., 4\)"):
            call()


def test_an_empty_array_has_no_solutions() -> None:
    assert batch.inverse(ARM, np.empty((0, 4))).shape == (0, 2, 4)


@given(FRAMES, FRAMES)
def test_frames_compose_and_invert(one: Pose, other: Pose) -> None:
    assert same_pose(one.compose(one.inverse()), IDENTITY)
    assert same_pose(one.inverse().compose(one.compose(other)), other)


@given(ARMS, JOINTS, JOINTS, st.floats(0.0, 0.3), ANGLES)
def test_no_point_of_a_load_is_faster_than_the_bound(
    kinematics: Scara,
    joints: tuple[float, ...],
    rates: tuple[float, ...],
    overhang: float,
    bearing: float,
) -> None:
    """The points at the overhang move with the tool; one of them is exactly at the bound."""
    laden = Scara(
        kinematics.geometry, kinematics.limits, kinematics.tool, kinematics.base, overhang
    )
    bound = laden.tool_speed(joints, rates)
    speeds = []
    jacobian = kinematics.jacobian(joints)
    vx, vy, vz, w = (sum(a * b for a, b in zip(row, rates, strict=True)) for row in jacobian)
    # Towards the sides of the tool's own motion.
    across = math.atan2(vx, -vy)
    for turn in (bearing, across, across + math.pi):
        x, y = overhang * math.cos(turn), overhang * math.sin(turn)
        speeds.append(math.hypot(vx - w * y, vy + w * x, vz))
    assert max(speeds) == pytest.approx(bound, rel=1e-9, abs=1e-12)
    assert bound >= kinematics.tool_speed(joints, rates) * (1.0 - 1e-12)
    assert batch.tool_speeds(laden, joints, rates) == pytest.approx(bound, rel=1e-6, abs=1e-9)
