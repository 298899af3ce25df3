"""Switches on a bus as slow as the real one, and the warnings about odd ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara.drivers import Gripper, Pwm
from bioscara.errors import JointError, ModeSwitchError
from bioscara.hardware import GripperHardware, LifecycleState
from bioscara.model import load_parameters
from bioscara.protocol import SILENCE
from bioscara.sim import SimulatedArm, SimulatedServo
from control.control_stack import LIMITS, NAMES, World
from control.scripted_controller import Wild, wild

MIDDLE = {"j1": 0.0, "j2": 0.2, "j3": 0.0, "j4": 0.0}
VELOCITIES = tuple(f"{name}/velocity" for name in NAMES)
ROS_TIMEOUT = 1.0
"""Default timeout of ros2_control for a switch [s]."""
OFTEN = 300


def moving(world: World) -> Wild:
    """Let a controller move all joints at a fifth of their speeds."""
    kinds = world.commanded
    mover = wild(world, "mover", *(f"{name}/{kind}" for name in NAMES for kind in kinds))
    speeds = dict.fromkeys(NAMES, 0.0)
    world.switch("mover")

    def move() -> None:
        for handle in mover.command_handles:
            name = handle.joint
            if handle.kind == "position":
                limit, period = LIMITS[name], 1.0 / world.rate
                speed = speeds[name] + 0.3 * limit.max_acceleration * period
                speeds[name] = min(speed, 0.2 * limit.max_velocity)
                handle.value += speeds[name] * period
            else:
                handle.value = speeds[name]

    mover.hooks["update"] = move
    world.run(0.4)
    return mover


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_rule_53_a_switch_is_done_when_it_returns_long_before_a_joint_misses_a_setpoint(
    v1: bool,
) -> None:
    world = World(v1=v1, at=MIDDLE, frequency=100e3)
    mover, hold = moving(world), world.manager.controller("hold")
    moved, cycles = len(mover.periods), world.loop.statistics.cycles
    costs = []

    def switch(*activate: str, off: tuple[str, ...] = ()) -> None:
        begin = world.clock.now()
        world.switch(*activate, off=off)
        costs.append(world.clock.now() - begin)

    switch("hold", off=("mover",))
    assert (hold.state, mover.state) == (LifecycleState.ACTIVE, LifecycleState.INACTIVE)
    assert world.manager.claims.commands["j1/position"].owner == "hold"
    assert world.loop.statistics.cycles == cycles, "it took a cycle"
    before = world.axis("j1").position_command.value
    world.loop.step()
    assert len(mover.periods) == moved
    # The hold ramps down from where the other one left off.
    assert world.axis("j1").position_command.value > before
    world.run(0.1)
    switch(off=("hold",))
    assert {axis.mode.name for axis in world.hardware.axes} == {"NONE"}
    assert costs[0] == 0.0, "taking over needs no bus"
    assert max(costs) + 1.0 / world.rate < SILENCE < ROS_TIMEOUT, costs
    assert not world.supervisor.faults


def test_rule_51_releasing_a_velocity_that_is_not_0_is_warned_about() -> None:
    world = World(at=MIDDLE)
    moving(world)
    speed = world.axis("j2").velocity_command.value
    assert speed > 0.0
    world.switch(off=("mover",))
    said = list(world.manager.warnings)
    assert [each.split(" ")[0] for each in said] == list(VELOCITIES)
    assert said[1] == (
        f"j2/velocity is released while it commands {speed:g} m/s: j2 is brought to rest; command "
        "0 first"
    )
    assert "rad/s" in said[0]
    world.run(0.5)
    assert max(abs(world.arm.velocity(name)) for name in NAMES) < 0.01


def test_rule_51_no_warning_where_the_switch_is_refused() -> None:
    world = World(at=MIDDLE)
    moving(world)
    wild(world, "both", "j1/home", "j2/position")
    world.axis("j2").halted = JointError("j2: out of order", "j2")
    with pytest.raises(ModeSwitchError, match="j2 cannot be commanded"):
        world.switch("both", off=("mover",))
    assert not world.manager.warnings


def test_rule_51_no_warning_where_motion_goes_on_or_has_ended() -> None:
    world = World(at=MIDDLE)
    moving(world)
    world.switch("hold", off=("mover",))
    world.run(1.0)
    world.switch(off=("hold",))
    assert not world.manager.warnings


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_rule_51_releasing_an_unclaimed_interface_is_warned_about_and_harmless(v1: bool) -> None:
    world = World(home=False, v1=v1)
    hardware = world.hardware
    [said] = hardware.prepare_command_mode_switch((), ("j3/velocity",))
    assert said == "j3/velocity is released, but was not claimed"
    hardware.perform_command_mode_switch((), ("j3/velocity",))
    # Hardware that was taken down behind the manager's back has forgotten all claims.
    homing = wild(world, "a", "j1/home")
    world.switch("a")
    hardware.deactivate()
    hardware.activate()
    world.switch(off=("a",))
    assert homing.state is LifecycleState.INACTIVE
    assert list(world.manager.warnings) == ["j1/home is released, but was not claimed"]


def test_rule_51_the_gripper_warns_too(tmp_path: Path) -> None:
    servo = load_parameters().gripper
    with SimulatedServo(servo.outputs[0]) as made:
        clock = SimulatedArm().clock
        driver = Gripper(Pwm(servo.outputs, clock, made.root), servo, tmp_path / "width")
        gripper = GripperHardware("jaws", "gripper", driver, clock)
        gripper.set_state(LifecycleState.ACTIVE)
        name = "gripper/position"
        [said] = gripper.prepare_command_mode_switch((), (name,))
        assert said == f"{name} is released, but was not claimed"
        gripper.perform_command_mode_switch((name,), ())
        assert not gripper.prepare_command_mode_switch((), (name,))
        gripper.shutdown()


def test_warnings_are_bounded_the_latest_are_kept() -> None:
    world = World(home=False)
    world.manager.load("a", Wild.TYPE, {"update_rate": 70})
    world.manager.load("b", Wild.TYPE, {"update_rate": 30})
    for _ in range(OFTEN):
        world.manager.configure("a")
    world.manager.configure("b")
    assert len(world.manager.warnings) < OFTEN
    assert world.manager.warnings[-1].startswith("b: update_rate 30 Hz")
