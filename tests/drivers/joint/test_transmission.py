"""Joint units and motor units: laws, and the numbers of the arm."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from bioscara.drivers import Transmission

REDUCTIONS = st.sampled_from([35.0, -2 * math.pi / 0.004, 24.0, 12.0])
VALUES = st.floats(-100.0, 100.0)


@given(REDUCTIONS, VALUES, VALUES)
def test_conversion_to_motor_units_and_back_is_the_identity(
    reduction: float, offset: float, position: float
) -> None:
    transmission = Transmission(reduction, offset)
    there = transmission.position_to_deg(position)
    assert transmission.position_from_deg(there) == pytest.approx(position, abs=1e-11)
    rpm = transmission.velocity_to_rpm(position)
    assert transmission.velocity_from_rpm(rpm) == pytest.approx(position, abs=1e-12)


@given(REDUCTIONS, VALUES, VALUES)
def test_the_offset_is_the_position_at_encoder_zero(
    reduction: float, offset: float, angle_deg: float
) -> None:
    transmission = Transmission(reduction, offset)
    assert transmission.position_to_deg(offset) == 0.0
    moved = transmission.position_from_deg(angle_deg) - offset
    assert moved == pytest.approx(math.radians(angle_deg) / reduction, abs=1e-12)


def test_a_turn_of_the_spindle_is_four_millimetres_down() -> None:
    transmission = Transmission(-2 * math.pi / 0.004, offset=0.338)
    assert transmission.position_from_deg(360.0) == pytest.approx(0.334)
    assert transmission.velocity_to_rpm(0.004) == pytest.approx(-60.0)
    assert transmission.size_to_deg(0.03) == pytest.approx(2700.0)
    assert transmission.microsteps_to_displacement(51200) == pytest.approx(-0.004)
