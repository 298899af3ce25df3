"""A jog enters no zone, exceeds no limit, and stops when the commands end."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

from bioscara.errors import InvalidArgumentError, LimitError, ZoneError
from bioscara.kinematics import Joints, Scara
from bioscara.planning.collision.scene import Box, Cylinder, Scene
from bioscara.planning.limits import JointLimits
from bioscara.planning.motions.jog import EXPIRY, JogGenerator, JointVelocity, ToolVelocity
from bioscara.planning.motions.jog_limitation import JogLimit, JogLimitation
from planning.limits import LIMITS
from planning.sampled_contact import touched
from planning.scenes import ARM, COUNT, free_joints, random_scene

REST = Joints(0.3, 0.2, 0.8, -0.5)
PERIOD = 0.02
BELTS = (0.23, 0.107)
"""Windows over which commands are averaged, in tests with averages [s]."""


def limit_of(jog: JogGenerator) -> JogLimit | None:
    return None if jog.limitation is None else jog.limitation.limit


def random_velocity(rng: np.random.Generator) -> JointVelocity | ToolVelocity:
    share = rng.uniform(-1.0, 1.0, 4) * (rng.random(4) < 0.7)
    if rng.random() < 0.5:
        rates = [limit.max_velocity for limit in LIMITS]
        return JointVelocity(*(share * rates).tolist())
    return ToolVelocity(*(share * [0.3, 0.3, 0.03, 2.0]).tolist())


def at_a_zone(rng: np.random.Generator, scene: Scene, joints: Joints) -> ToolVelocity:
    shape = scene.zones[rng.integers(len(scene.zones))].shape
    pose, speed = ARM.forward(joints), rng.uniform(0.05, 0.3)
    x, y = shape.x - pose.x, shape.y - pose.y
    far = max(math.hypot(x, y), 1e-3)
    return ToolVelocity(x / far * speed, y / far * speed, 0.0, rng.uniform(-1.0, 1.0))


def held(jog: JogGenerator, velocity: JointVelocity | ToolVelocity, seconds: float) -> list[Joints]:
    """Return the positions while a command is repeated."""
    rows = []
    for number in range(round(seconds / PERIOD)):
        jog.command(velocity, number * PERIOD)
        rows.append(jog.step(number * PERIOD, PERIOD)[0])
    return rows


def test_no_sample_of_a_random_jog_enters_a_zone() -> None:
    rng = np.random.default_rng(8)
    tried = hindered = 0
    while tried < COUNT:
        scene = random_scene(rng)
        start = free_joints(rng, scene)
        if start is None:
            continue
        tried += 1
        jog = JogGenerator(ARM, LIMITS, start, scene, windows=BELTS if tried % 2 else ())
        rows, speeds, fast = [start], [Joints(0.0, 0.0, 0.0, 0.0)], 0.0
        now = 0.0
        for _ in range(2):
            aimed = rng.random() < 0.5
            velocity = at_a_zone(rng, scene, jog.positions) if aimed else random_velocity(rng)
            for _ in range(int(rng.integers(5, 40))):
                jog.command(velocity, now)
                positions, rates = jog.step(now, PERIOD)
                rows.append(positions)
                speeds.append(rates)
                fast = max(fast, ARM.tool_speed(positions, rates))
                hindered += limit_of(jog) is JogLimit.ZONE
                now += PERIOD
        between = np.linspace(0.0, 1.0, 5)[:-1, None, None]
        dense = (np.array(rows[:-1]) + between * np.diff(rows, axis=0)).reshape(-1, 4)
        assert scene.clearance(ARM, dense).min() >= scene.margin - 5e-4
        assert not touched(ARM, scene.zones, rows[-1])
        assert fast <= 0.25 * 1.005
        within_limits(rows, speeds)
    assert hindered > 0.5 * COUNT


def within_limits(
    rows: list[Joints], speeds: list[Joints], limits: Sequence[JointLimits] = LIMITS
) -> None:
    changes = np.abs(np.diff(speeds, axis=0)).max(axis=0)
    for joint, limit in enumerate(limits):
        column = [row[joint] for row in rows]
        assert limit.lower - 1e-8 <= min(column)
        assert max(column) <= limit.upper + 1e-8
        assert max(abs(row[joint]) for row in speeds) <= limit.max_velocity * (1 + 1e-9)
        assert changes[joint] <= limit.max_acceleration * PERIOD * (1 + 1e-9)


def test_the_arm_slows_down_and_rests_at_the_zones_border() -> None:
    pose = ARM.forward(REST)
    wall = Box("wall", (pose.x - 0.3, pose.y + 0.15, 0.0), (pose.x + 0.3, pose.y + 0.4, 0.6))
    scene = Scene((wall,))
    jog = JogGenerator(ARM, LIMITS, REST, scene)
    rows = held(jog, ToolVelocity(y=0.1), 6.0)
    clearances = scene.clearance(ARM, rows)
    assert str(jog.limitation) == "held: jaws at the margin of wall"
    assert max(map(abs, jog.velocities)) < 1e-3
    assert scene.margin - 1e-9 <= clearances[-1] < scene.margin + 1e-3
    # And it can leave.
    held(jog, ToolVelocity(y=-0.1), 1.0)
    assert jog.limitation is None
    assert ARM.forward(jog.positions).y < ARM.forward(rows[-1]).y - 0.05


def test_a_command_expires() -> None:
    jog = JogGenerator(ARM, LIMITS, REST)
    jog.command(ToolVelocity(x=0.1), 0.0)
    moving = []
    for number in range(60):
        _, rates = jog.step(number * PERIOD, PERIOD)
        moving.append(ARM.tool_speed(jog.positions, rates))
    last = int(EXPIRY / PERIOD)
    assert min(moving[4 : last + 1]) > 0.09
    assert moving[last + 1] < moving[last]
    assert moving[-1] == 0.0
    assert limit_of(jog) is JogLimit.EXPIRED


@example(seed=122806, cycles=29, expired=False)  # slowed down by the tool's speed just before
@example(seed=2005205432, cycles=26, expired=False)  # the same, only a little
@given(seed=st.integers(0, 2**32 - 1), cycles=st.integers(1, 50), expired=st.booleans())
def test_a_released_arm_gets_no_faster_even_if_it_still_accelerated(
    seed: int, cycles: int, expired: bool
) -> None:
    jog = JogGenerator(ARM, LIMITS, REST, windows=BELTS)
    velocity = random_velocity(np.random.default_rng(seed))
    held(jog, velocity, cycles * PERIOD)
    now = cycles * PERIOD
    if expired:
        now += EXPIRY
    else:
        jog.command(type(velocity)(), now)
    released = ARM.tool_speed(jog.positions, jog.velocities)
    for _ in range(30):
        before = jog.velocities
        now += PERIOD
        _, after = jog.step(now, PERIOD)
        if isinstance(velocity, JointVelocity):
            assert np.all(np.abs(after) <= np.abs(before) + 1e-9)
        else:
            # On the tool's line a joint may get faster, and a stretched arm leaves the line: the
            # hand then turns about the axis of the wrist.
            turning = 0.12 * abs(sum(after) - after.j2) * (abs(jog.positions.j3) < 0.1)
            assert ARM.tool_speed(jog.positions, after) <= max(released, turning) + 0.025


def test_the_tool_moves_in_the_commanded_direction() -> None:
    jog = JogGenerator(ARM, LIMITS, REST)
    start = ARM.forward(REST)
    held(jog, ToolVelocity(x=-0.1, y=0.05, z=0.02), 1.0)
    pose = ARM.forward(jog.positions)
    way = np.array(pose) - start
    assert np.linalg.norm(np.cross(way[:3], (-0.1, 0.05, 0.02))) < 1e-3 * np.linalg.norm(way) ** 1
    assert abs(way[3]) < 1e-3
    assert np.linalg.norm(way[:3]) == pytest.approx(0.1136, rel=0.1)


def test_the_tool_gets_no_faster_where_one_joint_stops_before_the_others() -> None:
    # Wrist, elbow and base brake at once and rest one after the other, between two instants at
    # which the stopping path is checked.
    start = Joints(-2.0696, 0.0231, -0.0338, -0.8742)
    jog = JogGenerator(
        ARM, LIMITS, start, Scene((Cylinder("post", 0.116, -0.724, 0.007, 0.285, 0.544),))
    )
    speeds = []
    for number in range(35):
        towards = number < 23
        velocity = ToolVelocity(0.0825, -0.0261, 0.0, 0.3133)
        jog.command(
            velocity if towards else JointVelocity(0.4585, 0.015, 0.0, 9.0), number * PERIOD
        )
        speeds.append(ARM.tool_speed(*jog.step(number * PERIOD, PERIOD)))
    assert max(speeds) <= 0.25 * 1.001


def test_a_joint_at_its_limit_does_not_hold_the_others() -> None:
    jog = JogGenerator(ARM, LIMITS, REST._replace(j2=0.33), tool_speed=1.0)
    rows = held(jog, JointVelocity(j2=LIMITS[1].max_velocity, j4=0.5), 2.0)
    assert rows[-1].j2 == pytest.approx(LIMITS[1].upper, abs=1e-6)
    assert jog.velocities.j4 == pytest.approx(0.5)
    assert jog.limitation == JogLimitation(
        JogLimit.JOINT_LIMIT, True, "j2", 0.338, "m", "held: j2 at its upper limit 0.338 m"
    )


def test_the_arm_rests_between_velocities_of_joints_and_of_the_tool_and_says_so() -> None:
    jog = JogGenerator(ARM, LIMITS, REST, windows=BELTS)
    held(jog, JointVelocity(j4=0.5), 1.0)
    assert jog.limitation is None
    limits = []
    for number in range(50, 100):
        jog.command(ToolVelocity(z=0.02), number * PERIOD)
        jog.step(number * PERIOD, PERIOD)
        limits.append(limit_of(jog))
    resting = limits.count(JogLimit.CHANGE)
    assert limits == [JogLimit.CHANGE] * resting + [None] * (50 - resting)
    assert 10 < resting < 30


@pytest.mark.parametrize("elbow", [0.4, -0.4])
def test_the_arm_does_not_flip_over_when_it_is_stretched(elbow: float) -> None:
    jog = JogGenerator(ARM, LIMITS, Joints(0.0, 0.2, elbow, 0.0))
    bearing = math.atan2(*ARM.forward(jog.positions)[1::-1])
    outwards = ToolVelocity(x=0.2 * math.cos(bearing), y=0.2 * math.sin(bearing))
    rows = held(jog, outwards, 5.0)
    assert all(row.j3 * elbow > 0.0 for row in rows)
    assert abs(rows[-1].j3) < 0.1
    assert max(map(abs, jog.velocities)) < 1e-2
    held(jog, ToolVelocity(x=-outwards.x, y=-outwards.y), 1.0)
    assert abs(jog.positions.j3) > 0.1


@pytest.mark.parametrize(("lower", "upper", "elbow"), [(0.5, 2.6, 0.7), (-2.6, -0.5, -0.7)])
def test_the_tool_takes_no_joint_past_a_limit_before_it_is_stretched(
    lower: float, upper: float, elbow: float
) -> None:
    limits = list(LIMITS)
    limits[2] = dataclasses.replace(LIMITS[2], lower=lower, upper=upper)
    arm = Scara(ARM.geometry, limits, ARM.tool)
    jog = JogGenerator(arm, limits, Joints(0.3, 0.2, elbow, -0.5))
    outward = arm.forward(jog.positions)
    far = math.hypot(outward.x, outward.y)
    rows = held(jog, ToolVelocity(0.2 * outward.x / far, 0.2 * outward.y / far), 3.0)
    assert all(lower - 1e-6 <= row.j3 <= upper + 1e-6 for row in rows)
    assert jog.limitation is not None
    assert (jog.limitation.limit, jog.limitation.name) == (JogLimit.JOINT_LIMIT, "j3")


def test_the_tool_does_not_lead_an_elbow_past_half_a_turn_back_through_it() -> None:
    limits = list(LIMITS)
    limits[2] = dataclasses.replace(LIMITS[2], lower=-4.0, upper=4.0)
    arm = Scara(ARM.geometry, limits)
    jog = JogGenerator(arm, limits, Joints(0.3, 0.2, 3.3, -0.5))
    wrist = arm.forward(jog.positions)
    far = math.hypot(wrist.x, wrist.y)
    rows = held(jog, ToolVelocity(-0.05 * wrist.x / far, -0.05 * wrist.y / far), 3.0)
    assert min(row.j3 for row in rows) == pytest.approx(math.pi + 0.02, abs=1e-3)
    assert str(jog.limitation) == "x, y held: the elbow is folded; move outwards"


SIGNS = st.sampled_from([-1.0, 1.0])
OFFSETS = st.just(0.0) | st.builds(lambda sign, power: sign * 10.0**power, SIGNS, st.floats(-9, -2))
"""Elbow angles from straight or folded [rad]."""
HALF_TURNS = st.sampled_from([0, 1])
TURNABLE = [*LIMITS]
TURNABLE[2] = dataclasses.replace(LIMITS[2], lower=-4.0, upper=4.0)
SECONDS = 1.2


def at_end_of_reach(
    offset: float, half_turns: int, joints: Joints, windows: tuple[float, ...]
) -> tuple[JogGenerator, float]:
    """Return a jog of an arm that is nearly straight or folded, and the bearing of its wrist."""
    arm = Scara(ARM.geometry, TURNABLE, ARM.tool)
    start = joints._replace(j3=half_turns * math.pi + offset)
    jog = JogGenerator(arm, TURNABLE, start, windows=windows)
    wrist = Scara(ARM.geometry, TURNABLE).forward(start)
    return jog, math.atan2(wrist.y, wrist.x)


AT_END = {
    "offset": OFFSETS,
    "half_turns": HALF_TURNS,
    "joints": st.builds(
        Joints, st.floats(-1.5, 1.5), st.just(0.15), st.just(0.0), st.floats(-1.0, 1.0)
    ),
    "windows": st.sampled_from([(), BELTS]),
}


def smooth(jog: JogGenerator, velocity: ToolVelocity) -> list[Joints]:
    """Return the positions, of which no joint jumps, while a command is repeated."""
    rows, speeds = [jog.positions], [jog.velocities]
    for number in range(round(SECONDS / PERIOD)):
        jog.command(velocity, number * PERIOD)
        positions, rates = jog.step(number * PERIOD, PERIOD)
        rows.append(positions)
        speeds.append(rates)
        assert ARM.tool_speed(positions, rates) <= 0.25 * 1.005
    within_limits(rows, speeds, TURNABLE)
    steps = np.diff(rows, axis=0) - (np.array(speeds[:-1]) + speeds[1:]) * (PERIOD / 2.0)
    # A joint that brakes may rest before the end of a period.
    braking = np.array([limit.max_acceleration for limit in TURNABLE]) * PERIOD**2 / 8.0
    assert np.all(np.abs(steps) <= braking + 1e-9)
    return rows


@given(
    speed=st.floats(0.0, 0.15),
    bearing=st.floats(-math.pi, math.pi),
    z=st.floats(-0.02, 0.02),
    yaw=st.floats(-0.6, 0.6),
    **AT_END,
)
def test_z_and_yaw_move_a_straight_arm_whatever_x_and_y_are(
    offset: float,
    half_turns: int,
    joints: Joints,
    windows: tuple[float, ...],
    speed: float,
    bearing: float,
    z: float,
    yaw: float,
) -> None:
    jog, _ = at_end_of_reach(offset, half_turns, joints, windows)
    before = ARM.forward(jog.positions)
    smooth(jog, ToolVelocity(speed * math.cos(bearing), speed * math.sin(bearing), z, yaw))
    after = ARM.forward(jog.positions)
    for moved, wanted in ((after.z - before.z, z), (after.yaw - before.yaw, yaw)):
        assert moved * wanted >= 0.25 * wanted * wanted * SECONDS - 1e-9


@given(speed=st.floats(0.01, 0.15), aside=st.floats(-1.2, 1.2), **AT_END)
def test_a_straight_elbow_bends_when_the_tool_moves_to_where_the_wrist_can(
    offset: float,
    half_turns: int,
    joints: Joints,
    windows: tuple[float, ...],
    speed: float,
    aside: float,
) -> None:
    jog, bearing = at_end_of_reach(offset, half_turns, joints, windows)
    # The wrist of a folded arm is near to the column, which j1 turns six times as far as the elbow.
    speed, aside = (speed, aside) if half_turns == 0 else (0.1 * speed, 0.3 * aside)
    inwards = bearing + (math.pi if half_turns == 0 else 0.0) + aside
    x, y = math.cos(inwards), math.sin(inwards)
    before = ARM.forward(jog.positions)
    rows = smooth(jog, ToolVelocity(speed * x, speed * y))
    after = ARM.forward(jog.positions)
    along = (after.x - before.x) * x + (after.y - before.y) * y
    across = (after.x - before.x) * y - (after.y - before.y) * x
    assert along > 0.1 * speed * SECONDS
    # Averaged commands keep the line; without, the joints accelerate as fast as they can.
    assert abs(across) < (1e-3 if windows else 5e-3)
    side = math.copysign(1.0, offset)
    if offset:
        assert all((row.j3 - half_turns * math.pi) * side > 0.0 for row in rows)
    # And no nearer to straight than it was.
    turned = [abs(row.j3 - half_turns * math.pi) for row in rows]
    assert min(turned) >= abs(offset) - 1e-8


@given(speed=st.floats(0.01, 0.15), aside=st.floats(-1.4, 1.4), z=st.floats(-0.02, 0.02), **AT_END)
def test_a_straight_elbow_does_not_change_sides_and_says_why(
    offset: float,
    half_turns: int,
    joints: Joints,
    windows: tuple[float, ...],
    speed: float,
    aside: float,
    z: float,
) -> None:
    jog, bearing = at_end_of_reach(offset, half_turns, joints, windows)
    outwards = bearing + (0.0 if half_turns == 0 else math.pi) + aside
    before = ARM.forward(jog.positions)
    rows = smooth(jog, ToolVelocity(speed * math.cos(outwards), speed * math.sin(outwards), z))
    after = ARM.forward(jog.positions)
    assert math.hypot(after.x - before.x, after.y - before.y) < 2e-3
    side = math.copysign(1.0, offset)
    assert all((row.j3 - half_turns * math.pi) * side >= abs(offset) - 1e-8 for row in rows)
    assert jog.limitation is not None
    limit = JogLimit.STRETCHED if half_turns == 0 else JogLimit.FOLDED
    assert (jog.limitation.limit, jog.limitation.held) == (limit, True)


@given(
    before=st.none() | st.floats(-2.5, 2.5).filter(lambda angle: abs(angle) > 0.02),
    j1=st.floats(-3.0, 3.0),
    offset=st.floats(-1e-4, 1e-4),
)
def test_the_elbow_bends_to_the_side_on_which_it_was_or_that_has_room(
    before: float | None, j1: float, offset: float
) -> None:
    start = Joints(j1, 0.2, offset if before is not None else 0.0, 0.0)
    jog = JogGenerator(ARM, LIMITS, start, elbow=before)
    held(jog, ToolVelocity(-0.02 * math.cos(j1), -0.02 * math.sin(j1)), 0.6)
    # A positive elbow turns j1 back.
    expected = before if before is not None else (1.0 if j1 > -0.41 else -1.0)
    assert jog.positions.j3 * expected > 0.0


@given(st.floats(0.01, 0.25), st.floats(-math.pi, math.pi))
def test_the_cap_holds_in_every_direction(cap: float, bearing: float) -> None:
    jog = JogGenerator(ARM, LIMITS, REST, tool_speed=cap)
    fastest = 0.0
    for number in range(25):
        velocity = ToolVelocity(x=math.cos(bearing) * 0.9, y=math.sin(bearing) * 0.9)
        jog.command(velocity, number * PERIOD)
        fastest = max(fastest, ARM.tool_speed(*jog.step(number * PERIOD, PERIOD)))
    assert fastest <= cap * 1.001


def test_a_start_inside_a_zone_is_refused_with_numbers() -> None:
    pose = ARM.forward(REST)
    zone = Box("reader", (pose.x - 0.05, pose.y - 0.1, 0.0), (pose.x + 0.1, pose.y + 0.1, 0.3))
    with pytest.raises(ZoneError, match=r"reader at the start.* mm inside"):
        JogGenerator(ARM, LIMITS, REST, Scene((zone,)))


def test_a_start_outside_of_limits_is_refused() -> None:
    with pytest.raises(LimitError, match="j3 at the start: 3 rad is outside"):
        JogGenerator(ARM, LIMITS, REST._replace(j3=3.0))


@given(st.sampled_from([math.nan, math.inf, -math.inf]), st.integers(0, 4))
def test_a_value_that_is_no_number_is_refused(value: float, which: int) -> None:
    values = [0.0] * 5
    values[which] = value
    jog = JogGenerator(ARM, LIMITS, REST)
    for kind in (JointVelocity, ToolVelocity):
        with pytest.raises(InvalidArgumentError, match="not a finite number"):
            jog.command(kind(*values[:4]), values[4])
    assert jog.step(0.0, PERIOD) == (REST, Joints(0.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("windows", [(), BELTS])
@pytest.mark.parametrize("velocity", [ToolVelocity(y=0.2, yaw=0.5), JointVelocity(j1=0.2, j3=0.4)])
def test_a_share_of_0_decelerates_like_a_stop(
    velocity: JointVelocity | ToolVelocity, windows: tuple[float, ...]
) -> None:
    rows = []
    for last, share in ((velocity, 0.0), (JointVelocity(), 1.0)):
        jog = JogGenerator(ARM, LIMITS, REST, windows=windows)
        held(jog, velocity, 0.6)
        assert any(jog.velocities)
        rows.append([])
        for number in range(50):
            jog.command(last, number * PERIOD, share)
            rows[-1].append(jog.step(number * PERIOD, PERIOD))
        assert not any(jog.velocities)
    assert rows[0] == rows[1]


@pytest.mark.parametrize("share", [-0.1, 1.1, math.nan])
def test_a_share_is_between_0_and_1(share: float) -> None:
    jog = JogGenerator(ARM, LIMITS, REST)
    with pytest.raises(InvalidArgumentError, match="share"):
        jog.command(JointVelocity(j1=0.1), 0.0, share)
    assert jog.step(0.0, PERIOD) == (REST, Joints(0.0, 0.0, 0.0, 0.0))


def test_a_wrong_unit_is_named() -> None:
    jog = JogGenerator(ARM, LIMITS, REST)
    with pytest.raises(LimitError, match=r"x velocity: 50 m/s is outside -1 \.\. 1 m/s; .*mm/s"):
        jog.command(ToolVelocity(x=50.0), 0.0)
    with pytest.raises(LimitError, match=r"j1 velocity: 30 rad/s"):
        jog.command(JointVelocity(j1=30.0), 0.0)
    with pytest.raises(InvalidArgumentError, match="tool speed"):
        JogGenerator(ARM, LIMITS, REST, tool_speed=math.nan)


@pytest.mark.parametrize("period", [0.0, -0.02, math.nan, math.inf])
def test_a_period_must_be_above_zero(period: float) -> None:
    with pytest.raises(InvalidArgumentError, match=r"not above 0|not a finite"):
        JogGenerator(ARM, LIMITS, REST).step(0.0, period)
