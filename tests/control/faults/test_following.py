"""The following error of a joint against its setpoint, and the fault that reports it."""

from __future__ import annotations

import pytest

from bioscara.control.faults.following_error import FLOOR_SHARE, LAG, fade
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import FollowingError
from bioscara.hardware.axis import Axis
from control.control_stack import LIMITS, NAMES, World
from control.loop.test_loop import moving


def checks(world: World) -> dict[str, FollowingError | None]:
    period = world.loop.period
    due, fading = world.clock.now() + period, fade(period)
    return {
        name: following.check(due, fading)
        for name, following in zip(NAMES, world.supervisor._following, strict=True)
    }


def test_a_joint_that_follows_at_any_speed_is_not_complained_of() -> None:
    world = moving()
    world.run(4.0)
    assert world.supervisor.state is FaultState.CLEAR
    assert set(checks(world).values()) == {None}


@pytest.mark.parametrize("share", [0.5, 1.5])
def test_at_rest_the_limit_is_a_share_of_the_range(share: float) -> None:
    world = moving()
    world.run(8.0)
    axis: Axis = world.axis("j1")
    limit = FLOOR_SHARE * (LIMITS["j1"].upper - LIMITS["j1"].lower)
    axis.position.value += share * limit
    error = checks(world)["j1"]
    if share < 1.0:
        assert error is None
        return
    assert error is not None
    assert error.joint == "j1"
    assert error.error == pytest.approx(share * limit, abs=0.1 * limit)
    assert error.limit == pytest.approx(limit, rel=0.3)
    assert "j1" in str(error)
    assert "rad" in str(error)


def test_in_motion_the_limit_grows_with_the_speed() -> None:
    world = moving()
    axis: Axis = world.axis("j1")
    floor = FLOOR_SHARE * (LIMITS["j1"].upper - LIMITS["j1"].lower)
    axis.position.value -= 100.0 * floor
    error = checks(world)["j1"]
    assert error is not None
    assert error.limit > floor + 0.5 * LAG * abs(axis.velocity.value)


def test_an_unknown_position_is_no_following_error() -> None:
    world = moving()
    world.axis("j1").position.forget()
    assert checks(world)["j1"] is None
