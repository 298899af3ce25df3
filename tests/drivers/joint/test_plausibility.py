"""Plausibility of samples: a possible motion is accepted, a jump only when it is repeated."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from bioscara.drivers import JointSample, Quality
from bioscara.drivers.joint.plausibility import Plausibility
from bioscara.errors import CorruptFrameError
from bioscara.protocol import Flags
from simulated import ARM

J1 = ARM.joints[0]
inside = st.floats(J1.lower, J1.upper)


def sample(position: float, stamp: float) -> JointSample:
    return JointSample(position, 0.0, Flags(0), None, None, Quality.FRESH, stamp)


@given(inside, st.floats(0.005, 10.0), st.floats(-1.0, 1.0))
def test_a_possible_motion_is_plausible(position: float, time: float, speed: float) -> None:
    moved = min(max(position + speed * J1.max_velocity * time, J1.lower), J1.upper)
    Plausibility(J1).check(sample(position, 0.0), moved, speed, (0, 0), time)


@given(inside, inside, st.floats(0.0, 0.1))
def test_a_jump_is_rejected_once_and_accepted_when_repeated(
    before: float, after: float, time: float
) -> None:
    plausibility, last = Plausibility(J1), sample(before, 0.0)
    if abs(after - before) <= 1.5 * J1.max_velocity * max(time, 0.005) + 1e-9:
        return
    with pytest.raises(CorruptFrameError, match="cannot be"):
        plausibility.check(last, after, 0.0, (0, 0), time)
    plausibility.check(last, after, 0.0, (0, 0), time + 1e-3)


@pytest.mark.parametrize("value", [-4.0, 4.0, 1e30, math.nan])
def test_an_impossible_state_is_never_plausible(value: float) -> None:
    plausibility, last = Plausibility(J1), sample(0.0, 0.0)
    for stamp in (1.0, 1.01, 100.0):
        with pytest.raises(CorruptFrameError):
            plausibility.check(last, value, 0.0, (0, 0), stamp)
        with pytest.raises(CorruptFrameError):
            plausibility.check(last, 0.0, value, (0, 0), stamp)
    plausibility.check(last, value, value, (int(Flags.NOTENABLED),) * 2, 1.0)
