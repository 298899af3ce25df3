"""The home command: its sign is the direction, 0 stops it, and its end resets it."""

from __future__ import annotations

import math

import pytest

from bioscara.bus import Direction, When
from bioscara.errors import (
    BusTimeoutError,
    HomingError,
    InvalidArgumentError,
    JointLostError,
    ModeSwitchError,
)
from bioscara.hardware import ArmHardware, LifecycleState, Mode
from bioscara.protocol import Register
from control.control_stack import NAMES, PARAMETERS
from hardware.active_arm import BOTH, active, cycles, switch
from simulated import World

PERIOD = 0.02


def run_homing(world: World, arm: ArmHardware, name: str, seconds: float = 60.0) -> list[Exception]:
    problems: list[Exception] = []
    for _ in range(round(seconds / PERIOD)):
        problems += cycles(world, arm, period=PERIOD)
        if not arm.commands[f"{name}/home"].value:
            break
    return problems + cycles(world, arm, period=PERIOD)


@BOTH
def test_the_end_of_homing_resets_the_command_and_says_homed(v1: bool) -> None:
    world, arm = active(v1=v1)
    switch(arm, "j1/home")
    assert arm.states["j1/home"].value == 0.0
    arm.commands["j1/home"].value = -1.0
    assert run_homing(world, arm, "j1") == []
    assert (arm.commands["j1/home"].value, arm.states["j1/home"].value) == (0.0, 1.0)
    assert arm.states["j1/position"].value == pytest.approx(world.arm.position("j1"), abs=4e-3)
    assert arm.states["j1/position"].value > PARAMETERS.joints[0].lower


def test_the_sign_of_the_command_is_the_direction() -> None:
    for sign in (-1.0, 7.0):
        world, arm = active()
        before = world.arm.position("j3")
        switch(arm, "j3/home")
        arm.commands["j3/home"].value = sign
        for _ in range(50):
            cycles(world, arm, period=PERIOD)
        assert (world.arm.position("j3") - before) * sign > 0.0


@BOTH
def test_0_stops_homing_and_the_joint_is_not_homed(v1: bool) -> None:
    world, arm = active(v1=v1)
    switch(arm, "j3/home")
    arm.commands["j3/home"].value = -1.0
    cycles(world, arm, 170, PERIOD)  # An original joint waits for half a second first.
    assert abs(world.arm.velocity("j3")) > 0.01
    arm.commands["j3/home"].value = 0.0
    cycles(world, arm, 30, PERIOD)
    assert abs(world.arm.velocity("j3")) < 0.005
    assert arm.states["j3/home"].value == 0.0
    switch(arm, stop=("j3/home",))
    assert arm.axes[2].mode is Mode.NONE


@BOTH
def test_rule_51_home_is_not_left_while_homing_runs(v1: bool) -> None:
    world, arm = active(v1=v1)
    switch(arm, "j3/home")
    arm.commands["j3/home"].value = 1.0
    cycles(world, arm, period=PERIOD)
    with pytest.raises(ModeSwitchError, match="j3 is homing: command 0 to j3/home first"):
        arm.prepare_command_mode_switch([], ["j3/home"])
    with pytest.raises(ModeSwitchError, match="j3 is homing"):
        arm.prepare_command_mode_switch(["j3/position"], ["j3/home"])


def test_rule_51_no_other_joint_moves_while_one_homes() -> None:
    world, arm = active()
    joint = arm.joints[3]
    joint.home()
    cycles(world, arm, period=PERIOD)
    switch(arm, "j3/home")
    arm.commands["j3/home"].value = 1.0
    cycles(world, arm, period=PERIOD)
    with pytest.raises(ModeSwitchError, match="j4 cannot be moved while j3 is homing"):
        arm.prepare_command_mode_switch(["j4/position"], [])


def test_a_homing_is_refused_while_another_joint_is_homing_or_under_command() -> None:
    world, arm = active()
    arm.joints[3].home()
    cycles(world, arm, period=PERIOD)
    switch(arm, "j1/home", "j2/home", "j4/position")
    arm.commands["j1/home"].value = -1.0
    assert "while j4 is under command" in str(cycles(world, arm, period=PERIOD)[0])
    assert arm.commands["j1/home"].value == 0.0
    switch(arm, stop=("j4/position",))
    arm.commands["j1/home"].value = -1.0
    arm.commands["j2/home"].value = 1.0
    assert "while j1 is homing" in str(cycles(world, arm, period=PERIOD)[0])
    assert arm.commands["j2/home"].value == 0.0
    assert arm.axes[0].homing.running


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_command_without_a_direction_starts_nothing(value: float) -> None:
    world, arm = active()
    switch(arm, "j3/home")
    arm.commands["j3/home"].value = value
    world.tap.calls.clear()
    assert [type(problem) for problem in cycles(world, arm, period=PERIOD)] == [
        InvalidArgumentError
    ]
    assert world.tap.count(Register.HOME) == 0


def test_homing_without_an_end_stop_ends_with_that_reason() -> None:
    world, arm = active()
    world.arm.remove_stops("j4")
    switch(arm, "j4/home")
    arm.commands["j4/home"].value = 1.0
    problems = run_homing(world, arm, "j4", 150.0)
    assert isinstance(problems[0], HomingError)
    assert "j4" in str(problems[0])
    assert arm.states["j4/home"].value == 0.0


def test_a_joint_without_host_stops_homing_autonomously() -> None:
    world, arm = active()
    switch(arm, "j3/home")
    arm.commands["j3/home"].value = -1.0
    cycles(world, arm, 30, PERIOD)
    world.arm.run(0.5)  # the load swings behind its belt
    assert abs(world.arm.velocity("j3")) < 0.005


@BOTH
def test_a_lift_in_home_mode_stays_enabled(v1: bool) -> None:
    world, arm = active(v1=v1)
    before = world.arm.position("j2")
    switch(arm, *(f"{name}/home" for name in NAMES))
    cycles(world, arm, 50, PERIOD)
    assert world.arm.has_torque("j2")
    assert world.arm.position("j2") == pytest.approx(before, abs=2e-4)
    switch(arm, stop=tuple(f"{name}/home" for name in NAMES))
    assert world.arm.has_torque("j2")


@pytest.mark.parametrize("kind", [{}, {"v1_frames": True}, {"v1": True}])
def test_a_homing_after_a_motion_waits_for_rest_and_no_cycle_waits_for_it(
    kind: dict[str, bool],
) -> None:
    world = World(**kind)
    world.ready("j4")
    arm = ArmHardware("arm", world.bus, world.arm.clock, PARAMETERS.joints)
    arm.set_state(LifecycleState.ACTIVE)
    switch(arm, "j4/velocity")
    arm.commands["j4/velocity"].value = -5.0
    cycles(world, arm, 40, PERIOD)
    assert world.arm.velocity("j4") < -4.0
    switch(arm, "j4/home", stop=("j4/velocity",))
    arm.commands["j4/home"].value = 1.0
    world.tap.calls.clear()
    longest = 0.0
    while arm.axes[3].joint.readiness.blocking is not Register.HOME:
        start = world.arm.now()
        arm.read(start, PERIOD)
        arm.write(start, PERIOD)
        longest = max(longest, world.arm.now() - start)
        world.arm.clock.sleep_until(start + PERIOD)
        assert arm.problems == []
        assert arm.axes[3].homing.running
    assert longest < 10e-3
    assert abs(world.arm.velocity("j4")) < 0.05
    before = world.arm.position("j4")
    cycles(world, arm, 75, PERIOD)
    assert world.arm.position("j4") > before + 0.005


@pytest.mark.parametrize("waited", [0, 1, 3])
def test_a_homing_that_is_stopped_before_it_began_does_not_begin(waited: int) -> None:
    world, arm = active(v1=True)
    arm.axes[3].joint.disable()
    switch(arm, "j4/home")
    arm.commands["j4/home"].value = 1.0
    cycles(world, arm, 1 + waited, PERIOD)
    assert world.tap.count(Register.HOME) == 0
    arm.commands["j4/home"].value = 0.0
    assert cycles(world, arm, 50, PERIOD) == []
    assert world.tap.count(Register.HOME) == 0
    assert not arm.axes[3].homing.running


def test_deactivation_ends_a_homing() -> None:
    world, arm = active()
    switch(arm, "j1/home")
    arm.commands["j1/home"].value = -1.0
    cycles(world, arm, 10, PERIOD)
    arm.deactivate()
    assert not arm.axes[0].homing.running
    assert abs(world.arm.velocity("j1")) < 0.002
    assert not world.arm.has_torque("j1")


@BOTH
def test_a_stop_that_is_lost_is_repeated_in_the_next_cycle(v1: bool) -> None:
    world, arm = active(v1=v1)
    switch(arm, "j3/home")
    arm.commands["j3/home"].value = -1.0
    cycles(world, arm, 50, PERIOD)
    world.bus.lose(Direction.OUT, When(address=0x13, first=Register.STOP, count=3))
    arm.commands["j3/home"].value = 0.0
    (problem,) = cycles(world, arm, period=PERIOD)
    assert isinstance(problem, JointLostError)
    assert isinstance(problem.reason, BusTimeoutError)
    assert arm.axes[2].homing.running
    assert cycles(world, arm, period=PERIOD) == []
    assert not arm.axes[2].homing.running
    world.arm.run(0.5)
    assert abs(world.arm.velocity("j3")) < 0.005


def test_a_start_whose_answers_are_lost_leaves_nothing_running() -> None:
    world, arm = active(v1=True)
    switch(arm, "j3/home")
    world.bus.lose(Direction.BACK, When(address=0x13, first=Register.HOME))
    arm.commands["j3/home"].value = -1.0
    assert len(cycles(world, arm, 50, period=PERIOD)) == 1
    assert abs(world.arm.velocity("j3")) < 0.005
    assert not arm.axes[2].homing.running
