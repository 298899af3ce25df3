"""Behaviour of a joint under each command interface, and transitions between them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from bioscara.bus import Direction, When
from bioscara.errors import (
    InvalidArgumentError,
    JointFaultError,
    LimitError,
    ModeSwitchError,
    StalledError,
    SwitchError,
)
from bioscara.hardware import ArmHardware, LifecycleState, Mode
from bioscara.protocol import Register
from control.control_stack import NAMES, PARAMETERS, World as Stack
from hardware.active_arm import BOTH, PERIOD, active, cycles, switch
from simulated import World, home_error

FORWARD = "forward_command_controller/ForwardCommandController"


@pytest.mark.parametrize("kind", ["position", "velocity"])
@BOTH
def test_rule_51_position_and_velocity_are_refused_unless_homed(v1: bool, kind: str) -> None:
    _, arm = active(v1=v1)
    with pytest.raises(ModeSwitchError, match="j1 is not homed"):
        arm.prepare_command_mode_switch([f"j1/{kind}"], [])
    assert arm.axes[0].mode is Mode.NONE


@pytest.mark.parametrize("kind", ["position", "velocity"])
def test_rule_51_home_excludes_the_others(kind: str) -> None:
    _, arm = active(home=True)
    with pytest.raises(ModeSwitchError, match="cannot be commanded together"):
        arm.prepare_command_mode_switch([f"j1/{kind}", "j1/home"], [])
    switch(arm, f"j1/{kind}")
    with pytest.raises(ModeSwitchError, match="cannot be commanded together"):
        arm.prepare_command_mode_switch(["j1/home"], [])
    switch(arm, "j1/home", stop=(f"j1/{kind}",))
    assert arm.axes[0].mode is Mode.HOME


def test_rule_51_a_veto_for_one_joint_leaves_all_as_they_were() -> None:
    world, arm = active()
    joint = world.joint(PARAMETERS.joints[0])
    joint.init()
    joint.home()
    arm.set_state(LifecycleState.UNCONFIGURED)
    arm.set_state(LifecycleState.ACTIVE)
    with pytest.raises(ModeSwitchError, match="j2 is not homed"):
        switch(arm, "j1/position", "j2/position")
    assert [axis.mode for axis in arm.axes] == [Mode.NONE] * 4


def test_rule_51_a_joint_that_is_off_is_refused() -> None:
    world, arm = active(home=True)
    world.arm.overheat("j3")
    world.arm.run(0.05)
    arm.read(world.arm.now(), PERIOD)
    with pytest.raises(ModeSwitchError, match="j3 cannot be commanded: "):
        arm.prepare_command_mode_switch(["j3/position"], [])


def test_rule_51_a_joint_that_cannot_be_reached_is_refused_for_homing_too() -> None:
    world, arm = active(home=True)
    world.arm.set_power("j3", on=False)
    for _ in range(5):
        arm.read(world.arm.now(), PERIOD)
    for kind in ("position", "velocity", "home"):
        with pytest.raises(ModeSwitchError, match="j3 cannot be commanded: "):
            arm.prepare_command_mode_switch([f"j3/{kind}"], [])
    switch(arm, "j4/position")


def test_rule_51_a_joint_that_went_off_while_it_was_there_to_home_may_home_but_not_move() -> None:
    world, arm = active(home=True)
    switch(arm, "j3/home")
    arm.joints[2].disable()
    arm.read(world.arm.now(), PERIOD)
    assert arm.axes[2].halted is None
    with pytest.raises(
        ModeSwitchError, match="j3 cannot be commanded: j3: it is not enabled; enable"
    ):
        arm.prepare_command_mode_switch(["j3/position"], ["j3/home"])


def test_rule_51_a_joint_can_be_released_in_any_state() -> None:
    world, arm = active(home=True)
    switch(arm, "j3/position")
    world.arm.overheat("j3")
    world.arm.run(0.05)
    arm.read(world.arm.now(), PERIOD)
    assert arm.axes[2].halted is not None
    switch(arm, stop=("j3/position",))
    assert arm.axes[2].mode is Mode.NONE


@BOTH
def test_rule_51_releasing_a_joint_that_stopped_autonomously_sends_it_nothing(v1: bool) -> None:
    world, arm = active(v1=v1, home=True)
    switch(arm, "j3/position", "j4/position")
    world.arm.reset("j3")
    cycles(world, arm, 2)
    assert arm.axes[2].halted is not None
    before = world.tap.count(Register.STOP)
    switch(arm, stop=("j3/position", "j4/position"))
    assert world.tap.count(Register.STOP) == before + 1


def test_rule_51_position_with_velocity_needs_protocol_2() -> None:
    _, arm = active(v1=True, home=True)
    with pytest.raises(ModeSwitchError, match="claim position alone"):
        arm.prepare_command_mode_switch(["j1/position", "j1/velocity"], [])


@pytest.mark.parametrize(("first", "second"), [("position", "velocity"), ("velocity", "position")])
def test_rule_51_position_and_velocity_of_a_joint_are_claimed_together_or_not_at_all(
    first: str, second: str
) -> None:
    _, arm = active(home=True)
    switch(arm, f"j1/{first}")
    for change in (arm.prepare_command_mode_switch, arm.perform_command_mode_switch):
        with pytest.raises(ModeSwitchError, match=f"j1: {second} cannot be claimed while {first}"):
            change([f"j1/{second}"], [])
    assert arm.axes[0].mode is Mode({"position": Mode.POSITION, "velocity": Mode.VELOCITY}[first])
    switch(arm, f"j1/{first}", f"j1/{second}", stop=(f"j1/{first}",))
    assert arm.axes[0].mode is Mode.TRACK
    switch(arm, f"j1/{first}", f"j1/{second}", stop=(f"j1/{first}", f"j1/{second}"))
    assert arm.axes[0].mode is Mode.TRACK


def test_rule_51_an_unknown_interface_gets_a_proposal() -> None:
    _, arm = active()
    with pytest.raises(ModeSwitchError, match=r"did you mean j1/position\?"):
        arm.prepare_command_mode_switch(["j1/positon"], [])


@BOTH
def test_rule_25_a_claimed_joint_starts_from_where_it_is(v1: bool) -> None:
    world, arm = active(v1=v1, home=True)
    before = world.arm.position("j3")
    arm.commands["j3/position"].value = before - 1.0  # Left behind by the previous controller.
    arm.commands["j3/velocity"].value = -0.5
    switch(arm, "j3/position")
    error = 2e-3 + home_error("j3", v1=v1)
    assert arm.commands["j3/position"].value == pytest.approx(before, abs=error)
    assert arm.commands["j3/velocity"].value == 0.0
    cycles(world, arm, 50)
    assert world.arm.position("j3") == pytest.approx(before, abs=3e-3)


@BOTH
def test_rule_25_a_change_of_motion_mode_starts_from_the_measured_state(v1: bool) -> None:
    world, arm = active(v1=v1, home=True)
    switch(arm, "j3/velocity")
    arm.commands["j3/velocity"].value = -0.5
    cycles(world, arm, 60)
    switch(arm, "j3/position", stop=("j3/velocity",))
    here = world.arm.position("j3")
    assert arm.commands["j3/position"].value == pytest.approx(here, abs=0.05)
    arm.commands["j3/velocity"].value = 9.0
    switch(arm, "j3/velocity", stop=("j3/position",))
    assert arm.commands["j3/velocity"].value == pytest.approx(-0.5, abs=0.1)


@BOTH
def test_only_claimed_interfaces_are_written(v1: bool) -> None:
    world, arm = active(v1=v1, home=True)
    switch(arm, "j2/velocity", "j4/position")
    world.tap.calls.clear()
    arm.write(world.arm.now(), PERIOD)
    position = Register.MOVETOANGLE if v1 else Register.TRACKLOAD
    sent = {(t.address, t.write[0]) for call in world.tap.calls for t in call}
    assert sent - {(0x14, Register.ANGLEMOVED)} == {(0x14, position), (0x12, Register.SETRPM)}


@BOTH
def test_velocities_of_all_joints_are_one_bus_call(v1: bool) -> None:
    world, arm = active(v1=v1, home=True)
    switch(arm, *(f"{name}/velocity" for name in NAMES))
    arm.read(world.arm.now(), PERIOD)
    world.tap.calls.clear()
    arm.write(world.arm.now(), PERIOD)
    assert [[t.write[0] for t in call] for call in world.tap.calls] == [[Register.SETRPM] * 4]


@BOTH
def test_a_velocity_is_kept_while_it_is_commanded_and_ramped_down_afterwards(v1: bool) -> None:
    world, arm = active(v1=v1, home=True)
    switch(arm, "j3/velocity")
    arm.commands["j3/velocity"].value = -0.8
    cycles(world, arm, 60)
    assert world.arm.velocity("j3") == pytest.approx(-0.8, rel=0.1)
    assert arm.states["j3/velocity"].value == pytest.approx(-0.8, rel=0.1)
    switch(arm, stop=("j3/velocity",))
    cycles(world, arm, 30)
    # The motor stands; its load still swings behind the belt.
    assert abs(world.arm.velocity("j3")) < 0.03
    assert world.arm.has_torque("j3")


@BOTH
def test_rule_65_deactivation_stops_all_joints_before_it_waits_for_the_first(v1: bool) -> None:
    world, arm = active(v1=v1, home=True)
    speeds = {"j1": 0.5, "j3": -0.8, "j4": -1.0}
    switch(arm, *(f"{name}/velocity" for name in speeds))
    for name, speed in speeds.items():
        arm.commands[f"{name}/velocity"].value = speed
    cycles(world, arm, 60)
    before = {name: world.arm.position(name) for name in speeds}
    arm.deactivate()
    world.arm.run(0.2)
    for name, speed in speeds.items():
        braking = speed**2 / (2.0 * arm.limits[name].max_acceleration)
        assert abs(world.arm.position(name) - before[name]) < braking + 0.02 * abs(speed)
        assert not world.arm.has_torque(name)


@BOTH
def test_a_velocity_towards_a_limit_stops_the_joint_before_it(v1: bool) -> None:
    world, arm = active(v1=v1, home=True)
    switch(arm, "j4/velocity")
    arm.commands["j4/velocity"].value = 2.0
    problems = cycles(world, arm, 60)
    assert [type(problem) for problem in problems] == [LimitError]
    assert world.arm.position("j4") < PARAMETERS.joints[3].upper + home_error("j4", v1=v1)
    assert abs(world.arm.velocity("j4")) < 0.05


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e9])
def test_a_velocity_that_cannot_be_reaches_no_joint(value: float) -> None:
    world, arm = active(home=True)
    switch(arm, "j1/velocity", "j3/velocity")
    arm.commands["j3/velocity"].value = value
    world.tap.calls.clear()
    with pytest.raises(InvalidArgumentError, match="j3 velocity"):
        arm.write(world.arm.now(), PERIOD)
    assert world.tap.count(Register.SETRPM) == 0


def test_a_joint_that_misses_the_stop_stops_autonomously_and_is_reported() -> None:
    world, arm = active(home=True)
    switch(arm, "j3/velocity", "j4/velocity")
    for name in ("j3", "j4"):
        arm.commands[f"{name}/velocity"].value = -0.5
    cycles(world, arm, 50)
    world.bus.lose(Direction.OUT, When(address=0x13))
    switch(arm, stop=("j3/velocity", "j4/velocity"))
    assert [axis.mode for axis in arm.axes] == [Mode.NONE] * 4
    arm.read(world.arm.now(), PERIOD)
    assert "j3" in str(arm.problems[0])
    world.arm.run(0.5)
    assert abs(world.arm.velocity("j3")) < 0.02
    assert abs(world.arm.velocity("j4")) < 0.02


def test_a_stall_is_noticed_without_a_write_for_it() -> None:
    world, arm = active(home=True)
    switch(arm, "j3/velocity")
    arm.commands["j3/velocity"].value = -0.5
    cycles(world, arm, 40)
    world.arm.add_obstacle("j3", world.arm.position("j3") - 0.05)
    problems = cycles(world, arm, 60)
    # Which one depends on whether the setpoint or the state of that cycle came first.
    assert len(problems) == 1
    assert isinstance(problems[0], StalledError | JointFaultError)
    assert "stall" in str(problems[0]).lower()


def test_one_bad_exchange_does_not_end_a_velocity() -> None:
    world, arm = active(home=True)
    switch(arm, "j3/velocity")
    arm.commands["j3/velocity"].value = -0.5
    cycles(world, arm, 40)
    world.bus.lose(Direction.BACK, When(address=0x13, probability=0.2))
    cycles(world, arm, 60)
    assert arm.axes[2].halted is None
    assert world.arm.velocity("j3") == pytest.approx(-0.5, rel=0.1)


def test_the_manager_switches_all_or_nothing_over_the_hardware_veto() -> None:
    world = Stack(home=False)
    with pytest.raises(ModeSwitchError, match="is not homed"):
        world.switch("hold")
    assert world.manager.controller("hold").state is LifecycleState.INACTIVE
    assert all(command.owner is None for command in world.hardware.commands.values())


def test_limits_of_the_hardware_are_those_it_was_given() -> None:
    world = World()
    slow = tuple(replace(joint, max_velocity=joint.max_velocity / 2) for joint in PARAMETERS.joints)
    arm = ArmHardware("arm", world.bus, world.arm.clock, slow)
    assert {name: limit.max_velocity for name, limit in arm.limits.items()} == {
        joint.name: joint.max_velocity for joint in slow
    }


def test_rule_51_interfaces_of_inactive_hardware_cannot_be_commanded() -> None:
    world = Stack()
    world.hardware.deactivate()
    with pytest.raises(SwitchError, match="bioscara_arm is inactive; activate it first"):
        world.switch("hold")
