"""The meaning of the keys of a jog: a key that is not repeated ends its motion."""

from __future__ import annotations

import math

from hypothesis import given, strategies as st

from bioscara.cli.terminal.jog_keys import HOLD, JogKeys
from bioscara.kinematics import Joints, Pose
from bioscara.model import load_parameters
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity

JOINTS = load_parameters().joints
MOVING = "wsadrftg"
KEYS = st.lists(st.sampled_from([*MOVING, "up", "left", "m", "n", "+", "-", "x"]), max_size=30)


def pressed(keys: list[str], period: float = 0.03) -> tuple[JogKeys, float]:
    """The state after keys at a constant period, and the time of the last one."""
    state = JogKeys(JOINTS)
    for index, key in enumerate(keys):
        state.press(key, index * period)
    return state, (len(keys) - 1) * period


@given(KEYS)
def test_nothing_moves_once_no_key_was_repeated_for_a_moment(keys: list[str]) -> None:
    state, last = pressed(keys)
    assert 0.15 <= HOLD <= 0.3
    assert not any(state.velocity(last + HOLD))


@given(KEYS)
def test_no_velocity_exceeds_what_a_joint_or_the_tool_may_have(keys: list[str]) -> None:
    state, last = pressed(keys)
    velocity = state.velocity(last)
    assert sum(value != 0.0 for value in velocity) <= 1
    limits = [joint.max_velocity for joint in JOINTS]
    if isinstance(velocity, ToolVelocity):
        limits = [0.2, 0.2, 0.2, 1.0]
    assert all(abs(value) <= limit for value, limit in zip(velocity, limits, strict=True))


def test_a_held_key_moves_without_interruption_and_its_pair_moves_back() -> None:
    for there, back in ("ws", "ad", "rf", "tg"):
        state, _ = pressed([there])
        speeds = []
        for tick in range(100):
            if tick % 9 == 0:
                state.press(there, 0.01 * tick)
            speeds.append(state.velocity(0.01 * tick))
        assert len(set(speeds)) == 1
        state.press(back, 1.0)
        assert state.velocity(1.0) == tuple(-value for value in speeds[0])


def test_the_mode_selects_what_moves() -> None:
    state, _ = pressed(["r"])
    assert isinstance(velocity := state.velocity(0.0), ToolVelocity)
    assert velocity.z > 0.0
    state, _ = pressed(["m", "r"])
    assert isinstance(turned := state.velocity(0.03), JointVelocity)
    assert turned.j2 > 0.0


def test_steps_are_displacements_of_one_axis() -> None:
    state, last = pressed(["n", "t"])
    assert state.step is not None
    assert state.step.by == Pose(0.0, 0.0, 0.0, math.radians(0.5))
    assert not any(state.velocity(last))
    state, _ = pressed(["m", "n", "+", "f"])
    assert state.step is not None
    assert state.step.by == Joints(0.0, -1e-3, 0.0, 0.0)


def test_q_ends() -> None:
    assert pressed(["w", "q"])[0].ended
