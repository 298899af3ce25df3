"""A stuck bus is distinguished from lost joints, also where few of the joints are commanded."""

from __future__ import annotations

from typing import Any

import pytest

from bioscara.bus import Direction, When
from bioscara.control.faults.kinds import FaultKind
from bioscara.errors import BusStuckError, JointLostError
from bioscara.hardware import LifecycleState
from control.control_stack import NEAR, World

FORWARD = "forward_command_controller/ForwardCommandController"


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
@pytest.mark.parametrize("recognised", [False, True], ids=["timeouts", "reported"])
def test_a_stuck_bus_is_one_fault_where_one_joint_is_driven_by_velocity(
    v1: bool, recognised: bool
) -> None:
    world = World(v1=v1, at=NEAR)
    forward: Any = world.load("driven", FORWARD, joints=("j1",), interface_name="velocity")
    world.switch("driven")
    forward.command((0.3,))
    world.run(0.5)
    world.bus.stuck(recognised=recognised)
    world.run(1.0)
    (fault,) = world.supervisor.faults
    assert fault.kind is FaultKind.BUS_STUCK
    assert world.hardware.state is LifecycleState.ACTIVE
    world.bus.clear()
    world.run(0.5)
    # Nothing resumes automatically.
    assert all(axis.unreachable for axis in world.hardware.axes)
    assert abs(world.arm.velocity("j1")) < 0.01


def test_a_bus_that_gets_stuck_after_a_joint_was_lost_is_a_fault_of_its_own() -> None:
    world = World(at=NEAR)
    world.arm.set_power("j3", False)
    world.run(0.5)
    world.bus.stuck(recognised=False)
    world.run(0.5)
    lost, stuck = world.supervisor.faults
    assert (lost.kind, lost.source) == (FaultKind.JOINT_LOST, "j3")
    assert stuck.kind is FaultKind.BUS_STUCK
    assert "with 3 joints" in str(stuck)


def test_a_short_disturbance_of_all_joints_is_bridged() -> None:
    world = World(at=NEAR)
    world.run(0.1)
    world.bus.stuck(When(count=8), recognised=False)
    world.run(0.5)
    assert world.supervisor.faults == []


def test_half_of_all_frames_lost_is_no_stuck_bus() -> None:
    world = World(at=NEAR)
    for direction in Direction:
        world.bus.lose(direction, When(probability=0.29))
    world.run(20.0)
    assert world.supervisor.faults[0].kind is FaultKind.JOINT_LOST


def write_twice(world: World) -> None:
    """Send the commands of a cycle, and of the next one: a homing begins in steps."""
    world.hardware.write(world.clock.now(), 0.01)
    world.arm.run(0.01)
    world.hardware.write(world.clock.now(), 0.01)


def test_a_joint_whose_homing_is_not_answered_is_lost_and_the_others_are_asked() -> None:
    world = World(home=False)
    arm = world.hardware
    arm.prepare_command_mode_switch(("j2/home",), ())
    arm.perform_command_mode_switch(("j2/home",), ())
    arm.commands["j2/home"].value = 1.0
    world.bus.stuck(When(address=0x12), recognised=False)
    write_twice(world)
    (problem,) = arm.problems
    assert isinstance(problem, JointLostError)
    assert problem.joint == "j2"
    world.bus.stuck(recognised=False)
    arm.problems.clear()
    arm.commands["j2/home"].value = 1.0
    write_twice(world)
    (problem,) = arm.problems
    assert isinstance(problem, BusStuckError)


def test_one_joint_that_times_out_is_lost_also_if_the_adapter_calls_the_bus_stuck() -> None:
    world = World(at=NEAR)
    world.run(0.1)
    world.bus.stuck(When(address=0x14), recognised=True)
    world.run(0.5)
    (fault,) = world.supervisor.faults
    assert (fault.kind, fault.source) == (FaultKind.JOINT_LOST, "j4")


def test_the_last_joint_that_is_asked_shows_that_the_bus_works() -> None:
    world = World(home=False)
    arm = world.hardware
    arm.prepare_command_mode_switch(("j2/home",), ())
    arm.perform_command_mode_switch(("j2/home",), ())
    arm.commands["j2/home"].value = 1.0
    for address in (0x11, 0x12, 0x13):
        world.bus.stuck(When(address=address), recognised=False)
    write_twice(world)
    (problem,) = arm.problems
    assert isinstance(problem, JointLostError)
    assert problem.joint == "j2"
