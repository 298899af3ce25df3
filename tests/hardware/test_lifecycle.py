"""Lifecycle of the arm: joints greeted, engaged and released; and the effects of a failure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import pytest

from bioscara.bus import Transaction
from bioscara.drivers import Quality
from bioscara.errors import (
    BioscaraError,
    CommunicationError,
    HardwareError,
    JointError,
    JointFaultError,
    JointLostError,
    JointResetError,
    LifecycleError,
    NotHomedError,
    SwitchError,
)
from bioscara.hardware import ArmHardware, LifecycleState
from bioscara.protocol import Flags, Register
from bioscara.sim import FirmwareBus, SimulatedArm
from control.control_stack import NAMES, PARAMETERS, World as Stack
from hardware.active_arm import BOTH, PERIOD, active, switch, unconfigured
from simulated import Tap, World, home_error


def holding(**made: bool) -> Stack:
    """Return an arm that its controller holds."""
    world = Stack(**made)  # type: ignore[arg-type]
    world.switch("hold")
    world.run(0.1)
    return world


def powered(world: World) -> list[bool]:
    return [world.arm.has_torque(name) for name in NAMES]


def test_rule_56_states_have_the_numbers_and_labels_of_ros() -> None:
    assert [(state.value, state.label) for state in LifecycleState] == [
        (0, "unknown"),
        (1, "unconfigured"),
        (2, "inactive"),
        (3, "active"),
        (4, "finalized"),
    ]


def test_rule_56_paths_over_several_transitions_are_walked() -> None:
    world, arm = unconfigured()
    assert arm.set_state(LifecycleState.ACTIVE) is LifecycleState.ACTIVE
    assert powered(world) == [True] * 4
    assert arm.set_state(LifecycleState.UNCONFIGURED) is LifecycleState.UNCONFIGURED
    assert powered(world) == [False] * 4


def test_rule_56_finalized_is_never_left() -> None:
    world, arm = active()
    assert arm.set_state(LifecycleState.FINALIZED) is LifecycleState.FINALIZED
    assert powered(world) == [False] * 4
    for target in (LifecycleState.UNCONFIGURED, LifecycleState.INACTIVE, LifecycleState.ACTIVE):
        with pytest.raises(LifecycleError, match="finalized"):
            arm.set_state(target)
    assert arm.set_state(LifecycleState.FINALIZED) is LifecycleState.FINALIZED


def test_rule_56_unknown_is_no_state_to_go_to() -> None:
    _, arm = unconfigured()
    with pytest.raises(LifecycleError, match="arm: no component can be unknown"):
        arm.set_state(LifecycleState.UNKNOWN)
    assert arm.state is LifecycleState.UNCONFIGURED


def test_rule_56_an_unknown_component_is_refused_with_a_proposal() -> None:
    world = Stack(home=False)
    with pytest.raises(SwitchError, match="bioscara_arm"):
        world.manager.set_hardware_state("bioscara_ram", LifecycleState.INACTIVE, 0.0)


def test_rule_57_interfaces_are_available_from_configured_on() -> None:
    _, arm = unconfigured()
    assert not arm.available
    arm.configure()
    assert arm.available
    arm.activate()
    assert arm.available
    arm.set_state(LifecycleState.UNCONFIGURED)
    assert not arm.available
    assert all(math.isnan(state.value) for state in arm.states.values())
    arm.shutdown()
    assert not arm.available


def test_rule_57_hardware_deactivates_its_controllers_before_a_lower_state() -> None:
    world = Stack()
    world.switch("hold")
    world.manager.set_hardware_state("bioscara_arm", LifecycleState.INACTIVE, world.clock.now())
    assert world.manager.controller("hold").state is LifecycleState.INACTIVE
    assert all(command.owner is None for command in world.hardware.commands.values())


def test_rule_59_inactive_hardware_is_read_but_not_written() -> None:
    world = Stack()
    world.hardware.deactivate()
    world.arm.push("j3", -0.5)
    before = world.axis("j3").position.value
    world.run(0.5)
    assert world.axis("j3").position.value == pytest.approx(world.arm.position("j3"), abs=0.01)
    assert world.axis("j3").position.value != before
    assert not any(world.arm.has_torque(name) for name in NAMES)


@BOTH
def test_rule_63_a_failed_configure_leaves_no_joint_open(v1: bool) -> None:
    world, arm = unconfigured(v1=v1)
    world.arm.set_power("j4", False)
    with pytest.raises(BioscaraError, match="j4"):
        arm.configure()
    assert arm.state is LifecycleState.UNCONFIGURED
    assert [joint.version for joint in arm.joints] == [0] * 4
    world.arm.set_power("j4", True)
    world.arm.run(0.2)
    arm.set_state(LifecycleState.ACTIVE)
    assert powered(world) == [True] * 4


@BOTH
def test_rule_63_a_failed_activate_releases_every_joint(v1: bool) -> None:
    world, arm = unconfigured(v1=v1)
    arm.configure()
    world.arm.set_power("j4", False)
    with pytest.raises(BioscaraError, match="j4"):
        arm.activate()
    assert arm.state is LifecycleState.INACTIVE
    world.arm.run(1.0)
    assert powered(world) == [False] * 4


class Heater(Tap):
    """Overheats j1 as soon as j4, which is engaged last, receives its velocity."""

    def __init__(self, world: World) -> None:
        super().__init__(world.bus)
        self._arm = world.arm

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        if (transactions[0].address, transactions[0].write[0]) == (0x14, Register.SETMAXVELOCITY):
            self._arm.overheat("j1")
            self._arm.run(0.05)
        return super().transfer(transactions)


def test_rule_63_a_joint_that_drops_out_while_others_are_enabled_fails_the_activation() -> None:
    # Version 2 only: an original joint checks neither its temperature nor its supply.
    world = World()
    arm = ArmHardware("arm", Heater(world), world.arm.clock, PARAMETERS.joints)
    arm.configure()
    with pytest.raises(JointError, match="j1"):
        arm.activate()
    assert arm.state is LifecycleState.INACTIVE
    world.arm.run(1.0)
    assert powered(world) == [False] * 4


@BOTH
def test_rule_63_a_failed_deactivate_goes_through_error_to_unconfigured(v1: bool) -> None:
    world, arm = active(v1=v1)
    world.arm.set_power("j1", False)
    with pytest.raises(HardwareError, match="j1 may be energised"):
        arm.deactivate()
    world.arm.run(1.0)
    assert powered(world) == [False] * 4, "one joint that fails keeps no other energised"
    assert arm.state is LifecycleState.UNCONFIGURED


def test_transitions_that_do_not_exist_are_refused() -> None:
    _, arm = unconfigured()
    for step in (arm.activate, arm.deactivate, arm.cleanup):
        with pytest.raises(LifecycleError):
            step()
    arm.configure()
    for step in (arm.configure, arm.deactivate):
        with pytest.raises(LifecycleError):
            step()


@pytest.mark.parametrize(
    "before", [LifecycleState.UNCONFIGURED, LifecycleState.INACTIVE, LifecycleState.ACTIVE]
)
def test_shutdown_and_error_release_from_every_state(before: LifecycleState) -> None:
    for leave, after in (
        ("fail", LifecycleState.UNCONFIGURED),
        ("shutdown", LifecycleState.FINALIZED),
    ):
        world, arm = unconfigured()
        arm.set_state(before)
        getattr(arm, leave)()
        assert arm.state is after
        assert powered(world) == [False] * 4


@BOTH
def test_configure_pings_and_moves_nothing(v1: bool) -> None:
    world, arm = unconfigured(v1=v1)
    arm.configure()
    assert powered(world) == [False] * 4
    sent = {t.write[0] for call in world.tap.calls for t in call}
    moving = {Register.SETUP, Register.SETRPM, Register.MOVETOANGLE, Register.HOME}
    moving |= {Register.TRACK, Register.TRACKLOAD}
    assert not sent & {int(register) for register in moving}
    assert {t.address for call in world.tap.calls for t in call} == {0x11, 0x12, 0x13, 0x14}


@BOTH
def test_activate_sets_stall_guard_acceleration_and_velocity_on_joints_that_run_already(
    v1: bool,
) -> None:
    world, arm = unconfigured(v1=v1)
    for joint in world.ready():
        assert joint.is_enabled()
    arm.configure()
    world.tap.calls.clear()
    arm.activate()
    for register in (
        Register.SETUP,
        Register.ENABLESTALLGUARD,
        Register.SETMAXACCELERATION,
        Register.SETMAXVELOCITY,
    ):
        assert world.tap.count(register) == 4


@BOTH
def test_activation_reads_once_and_the_commands_are_the_measured_states(v1: bool) -> None:
    world, arm = active(v1=v1, home=True)
    for axis in arm.axes:
        error = 2e-3 + home_error(axis.name, v1=v1)
        assert axis.position.value == pytest.approx(world.arm.position(axis.name), abs=error)
        assert axis.position_command.value == axis.position.value
        assert axis.velocity_command.value == axis.home_command.value == 0.0
        assert axis.home.value == 1.0


@BOTH
def test_an_unknown_position_is_marked_and_never_zero(v1: bool) -> None:
    _, arm = active(v1=v1)
    arm.read(0.0, PERIOD)
    for axis in arm.axes:
        assert math.isnan(axis.position.value)
        assert axis.position.quality is Quality.UNKNOWN
        assert (axis.home.value, axis.home.quality) == (0.0, Quality.FRESH)
        assert math.isnan(axis.position_command.value)


def test_a_cycle_of_reading_is_one_bus_call_and_an_unclaimed_arm_is_sent_nothing() -> None:
    world, arm = active()
    world.tap.calls.clear()
    arm.read(0.0, PERIOD)
    arm.write(0.0, PERIOD)
    assert [[t.write[0] for t in call] for call in world.tap.calls] == [[Register.STATE] * 4]


def test_a_joint_that_failed_alone_is_left_out_and_reported() -> None:
    world = Stack()
    world.switch("hold")
    world.arm.set_power("j3", False)
    problems = []
    for _ in range(5):
        world.hardware.read(0.0, PERIOD)
        world.hardware.write(0.0, PERIOD)
        problems += world.hardware.problems
    assert [type(problem) for problem in problems] == [JointLostError]
    assert "j3" in str(problems[0])
    assert world.axis("j3").position.quality is Quality.UNKNOWN
    assert world.axis("j1").position.quality is Quality.FRESH


def test_no_joint_that_answers_is_an_error_of_the_whole() -> None:
    world, arm = active()
    world.bus.off()
    for _ in range(2):
        arm.read(0.0, PERIOD)
    with pytest.raises(HardwareError, match="no joint can be reached"):
        arm.read(0.0, PERIOD)
    arm.fail()
    world.bus.clear()
    assert arm.set_state(LifecycleState.ACTIVE) is LifecycleState.ACTIVE


@pytest.mark.parametrize("fed", [False, True], ids=["as built", "controllers fed"])
def test_usr1_usr2_power_that_comes_back_moves_nothing_and_the_arm_can_be_enabled(
    fed: bool,
) -> None:
    world = holding(controllers_fed=fed)
    world.arm.set_supply(False)
    world.run(0.5)
    before = [world.arm.position(name) for name in NAMES]
    world.hardware.set_state(LifecycleState.UNCONFIGURED) if world.hardware.available else None
    if not fed:
        with pytest.raises(BioscaraError):
            world.hardware.configure()
    world.arm.set_supply(True)
    world.arm.run(0.5)
    for name, position in zip(NAMES, before, strict=True):
        assert world.arm.position(name) == pytest.approx(position, abs=0.01)
    world.hardware.configure()
    world.hardware.clear_faults()
    world.hardware.activate()
    assert [axis.homed for axis in world.hardware.axes] == [fed] * 4
    if not fed:
        with pytest.raises(NotHomedError):
            world.joint("j1").get_position()


@BOTH
def test_usr3_a_joint_pushed_beyond_its_limit_is_held_there_and_only_moves_back(v1: bool) -> None:
    world = Stack(v1=v1)
    world.hardware.deactivate()
    world.arm.remove_stops("j1")
    world.arm.push("j1", -3.0)
    while world.arm.position("j1") > -3.07:
        world.arm.run(0.005)
    world.arm.push("j1", 0.0)
    world.arm.run(0.5)
    world.loop.restart()
    world.run(0.1)
    found = world.axis("j1").position.value
    assert found < -3.07 < PARAMETERS.joints[0].lower
    error = found - world.arm.position("j1")
    assert abs(error) < 2e-3 + home_error("j1", v1=v1)

    def where() -> float:
        """Return the position as the joint counts it."""
        return world.arm.position("j1") + error

    world.hardware.activate()
    world.loop.restart()
    world.switch("hold")
    world.run(0.5)
    assert where() == pytest.approx(found, abs=4e-3)
    others = [world.axis(name).position.value for name in NAMES[1:]]
    go: Any = world.load(
        "go",
        "forward_command_controller/ForwardCommandController",
        joints=NAMES,
        interface_name="position",
    )
    world.switch("go", off=("hold",))
    go.command([-4.0, *others])
    world.run(0.5)
    assert where() >= found - 4e-3
    go.command([-2.9, *others])
    outermost = []
    for _ in range(300):
        world.loop.step()
        outermost.append(where())
    assert outermost[-1] == pytest.approx(-2.9, abs=5e-3)
    assert all(b >= a - 4e-3 for a, b in pairwise(outermost))
    assert not world.supervisor.faults
    go.command([-4.0, *others])
    world.run(3.0)
    assert where() >= PARAMETERS.joints[0].lower - 4e-3


def test_a_joint_that_drops_out_at_rest_is_noticed_in_the_next_cycle() -> None:
    world = Stack()
    world.arm.overheat("j2")
    world.arm.run(0.05)
    world.hardware.read(world.clock.now(), PERIOD)
    assert isinstance(world.hardware.problems[0], JointFaultError)
    assert world.axis("j2").halted is world.hardware.problems[0]


@pytest.mark.parametrize("active", [True, False], ids=["engaged", "released"])
def test_fw1_a_joint_that_restarted_is_not_taken_for_homed_before_a_recovery(
    active: bool,
) -> None:
    world = Stack()
    if not active:
        world.hardware.deactivate()
    world.run(0.1)
    world.arm.reset("j3")
    world.run(0.3)
    axis = world.axis("j3")
    assert isinstance(axis.halted, JointResetError)
    assert not axis.homed
    for handle in (axis.position, axis.velocity, axis.home):
        assert handle.quality is Quality.UNKNOWN
        assert not handle.value > 0.0
    assert world.axis("j1").home.value == 1.0


def test_fw1_a_joint_that_restarts_while_it_is_halted_already_loses_its_home_too() -> None:
    world = Stack()
    world.arm.overheat("j3")
    world.run(0.1)
    assert isinstance(world.axis("j3").halted, JointFaultError)
    assert world.axis("j3").position.quality is Quality.FRESH
    world.arm.reset("j3")
    world.run(0.1)
    assert world.axis("j3").position.quality is Quality.UNKNOWN
    assert world.axis("j3").home.value == 0.0


def test_a_halted_joint_that_is_not_heard_any_more_is_never_fresh() -> None:
    world = Stack()
    world.arm.overheat("j3")
    world.run(0.1)
    world.arm.set_power("j3", False)
    for _ in range(20):
        world.run(0.01)
        assert world.axis("j3").position.quality is not Quality.FRESH
    assert world.axis("j1").position.quality is Quality.FRESH


@pytest.mark.parametrize("kind", ["position", "velocity"])
def test_a_joint_that_is_lost_between_two_readings_is_unknown(kind: str) -> None:
    world = Stack()
    arm, now = world.hardware, world.clock.now
    switch(arm, f"j3/{kind}")
    arm.read(now(), PERIOD)
    world.arm.set_power("j3", False)
    for _ in range(3):
        arm.write(now(), PERIOD)
        arm.read(now(), PERIOD)
    assert isinstance(world.axis("j3").halted, JointLostError)
    assert world.axis("j3").position.quality is Quality.UNKNOWN
    assert world.axis("j3").home.value == 0.0


@BOTH
def test_what_a_joint_answered_before_a_pause_is_asked_for_again(v1: bool) -> None:
    world = holding(v1=v1)
    world.arm.run(0.5)
    world.loop.restart()
    world.run(1.0 / world.rate)
    now = world.clock.now()
    for axis in world.hardware.axes:
        assert axis.position.quality is Quality.FRESH
        assert now - axis.position.stamp < 2.0 / world.rate


def test_what_a_joint_answered_before_a_cycle_that_came_late_is_asked_for_again() -> None:
    world = holding()
    world.arm.run(0.5)
    late = world.clock.now()
    world.hardware.read(late, 0.5)
    assert all(axis.position.stamp > late for axis in world.hardware.axes)


def test_what_a_joint_answered_before_it_was_released_is_asked_for_again() -> None:
    world = holding()
    begin = world.hardware._written
    world.hardware.deactivate()
    # However little time that took.
    world.hardware.read(begin, 1.0 / world.rate)
    assert all(axis.sample.flags & Flags.NOTENABLED for axis in world.hardware.axes)


@BOTH
def test_in_cycles_on_time_the_answers_to_the_commands_are_enough(v1: bool) -> None:
    world, arm = unconfigured(v1=v1)
    for joint in world.ready():
        joint.deinit()
    arm.set_state(LifecycleState.ACTIVE)
    switch(arm, *(f"{name}/position" for name in NAMES))
    period = 0.05
    for late in (0.0, 0.0, 0.001, 0.0, 0.0):
        start = world.arm.now()
        world.tap.calls.clear()
        arm.read(start, period)
        arm.write(start, period)
        world.arm.clock.sleep_until(start + period + late)
    assert len(world.tap.calls) == 1


def test_the_arm_is_usable_over_a_bus_of_no_time() -> None:
    arm = SimulatedArm(frequency=None)
    hardware = ArmHardware("arm", FirmwareBus(arm), arm.clock, PARAMETERS.joints)
    assert hardware.set_state(LifecycleState.ACTIVE) is LifecycleState.ACTIVE


def test_usr1_the_faults_of_an_arm_without_power_are_reported_once() -> None:
    world = Stack()
    world.switch("hold")
    for name in NAMES:
        world.arm.set_power(name, False)
    world.run(0.5)
    count = len(world.supervisor.faults)
    world.run(1.0)
    assert 0 < len(world.supervisor.faults) == count
