"""Parts of a manager, its start, and the settings that ros2_control has parameters for."""

from __future__ import annotations

import inspect
import math
import os
import subprocess
import sys
from dataclasses import MISSING, fields
from itertools import pairwise
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.bus import Transaction
from bioscara.control.controllers.joint_trajectory.pid import Gains
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import (
    Constraints,
    JointConstraints,
    SpeedScaling,
)
from bioscara.control.limits.limiter import Limiter, joint_limiters
from bioscara.control.loop.realtime import PRIORITY, realtime
from bioscara.control.manager.manager import ControllerManager
from bioscara.control.manager.registry import TYPES
from bioscara.drivers import Gripper, Pwm
from bioscara.errors import (
    BioscaraError,
    BusUnavailableError,
    ConfigurationError,
    GripperError,
    SwitchError,
)
from bioscara.hardware import ArmHardware, GripperHardware, LifecycleState
from bioscara.model.validation import Checked
from bioscara.sim import FirmwareBus, SimulatedArm, SimulatedServo
from control.control_stack import LIMITS, NAMES, NEAR, PARAMETERS, World
from control.scripted_controller import Box, boom, wild


def test_rule_42_a_manager_is_made_with_all_of_its_hardware(tmp_path: Path) -> None:
    arm, jaws = SimulatedArm(), PARAMETERS.gripper
    with SimulatedServo(jaws.outputs[0]) as servo:
        pwm = Pwm(jaws.outputs, arm.clock, servo.root)
        driver = Gripper(pwm, jaws, tmp_path / "width")
        components = (
            ArmHardware("bioscara_arm", FirmwareBus(arm), arm.clock, PARAMETERS.joints),
            GripperHardware("bioscara_gripper_128", "gripper", driver, arm.clock),
        )
        manager = ControllerManager(components, Limiter(joint_limiters(components)), 100)
        listed = manager.list_hardware_interfaces()
    joints = (*NAMES, "gripper")
    assert {each.name.partition("/")[0] for each in listed.state_interfaces} == set(joints)
    assert not any(each.is_available for each in listed.state_interfaces)
    with pytest.raises(AttributeError):
        manager.components = ()  # type: ignore[misc]


def test_rule_42_hardware_that_comes_twice_is_refused() -> None:
    box, other = Box(), Box()
    with pytest.raises(SwitchError, match="two hardware components are named box; rename one"):
        ControllerManager((box, other), Limiter(joint_limiters((box,))), 100)
    other.name = "other"
    with pytest.raises(SwitchError, match="g/position belongs to box and to other"):
        ControllerManager((box, other), Limiter(joint_limiters((box,))), 100)


def start(arm: SimulatedArm) -> Robot:
    return Robot(FirmwareBus(arm), arm.clock, PARAMETERS, "startup")


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_rule_58_a_start_identifies_the_joints_and_energises_and_moves_nothing(v1: bool) -> None:
    arm = SimulatedArm(seed=1, v1=v1, positions=NEAR)
    before = [arm.position(name) for name in NAMES]
    with start(arm) as robot:
        assert [each.state for each in robot.runner.arm.stack.manager.components] == [
            LifecycleState.INACTIVE, LifecycleState.UNCONFIGURED
        ]  # fmt: skip
        arm.run(1.0)
        assert not any(arm.has_torque(name) for name in NAMES)
        assert [arm.position(name) for name in NAMES] == pytest.approx(before, abs=1e-6)


@pytest.mark.parametrize("absent", NAMES)
def test_rule_58_one_joint_that_does_not_answer_releases_all_and_closes_the_bus(
    absent: str,
) -> None:
    arm = SimulatedArm(seed=1, positions=NEAR)
    arm.set_power(absent, on=False)
    robot = start(arm)
    with pytest.raises(BioscaraError, match=absent), robot:
        pass
    assert robot.runner.arm.session.hardware.state is LifecycleState.UNCONFIGURED
    assert [joint.session.version for joint in robot.joints] == [0] * 4
    assert not any(arm.has_torque(name) for name in NAMES)
    with pytest.raises(BusUnavailableError, match="closed"):
        robot.bus.transfer([Transaction(0x11, b"\x00", 1)])


def test_rule_58_one_joint_that_cannot_be_enabled_leaves_none_enabled() -> None:
    arm = SimulatedArm(seed=1, positions=NEAR)
    with start(arm) as robot:
        arm.set_power("j4", on=False)
        with pytest.raises(BioscaraError, match="j4"):
            robot.enable()
        assert robot.runner.arm.stack.hardware.state is LifecycleState.INACTIVE
        assert not any(arm.has_torque(name) for name in NAMES)
        arm.set_power("j4", on=True)


def test_rule_58_a_gripper_without_output_is_its_own_matter() -> None:
    arm = SimulatedArm(seed=1, positions=NEAR)
    with start(arm) as robot:
        with pytest.raises(GripperError):
            robot.gripper.enable()
        states = [each.state for each in robot.runner.arm.stack.manager.components]
        assert states == [LifecycleState.INACTIVE, LifecycleState.UNCONFIGURED]
        robot.enable()
        assert all(arm.has_torque(name) for name in NAMES)


@pytest.mark.parametrize(("v1", "rate", "period"), [(False, None, 0.01), (True, None, 0.02),
                                                    (False, 80, 0.0125)])  # fmt: skip
def test_rule_69_update_rate_suits_the_joints_unless_one_is_given(
    v1: bool, rate: int | None, period: float
) -> None:
    arm = SimulatedArm(seed=1, v1=v1, positions=NEAR)
    with Robot(FirmwareBus(arm), arm.clock, PARAMETERS, "rate", rate=rate) as robot:
        assert robot.period == period
        assert robot.runner.arm.stack.manager.rate == round(1.0 / period)


def test_rule_69_limits_are_enforced_and_exceptions_handled_always() -> None:
    world = World(at={"j1": 0.0, "j2": 0.2, "j3": 0.0, "j4": 0.0})
    a = wild(world, "a", "j1/position")
    world.switch("a")
    a.hooks["update"] = lambda: setattr(a.command_handles[0], "value", 100.0)
    world.run(0.05)
    limit = LIMITS["j1"]
    assert 0.0 < world.axis("j1").previous < 0.05 * limit.max_velocity
    a.hooks["update"] = boom()
    world.manager.cycle(world.clock.now(), 0.01)
    assert [each.source for each in world.manager.failures] == ["a"]
    for made in (ControllerManager, Limiter):
        assert not {"enforce_command_limits", "handle_exceptions"} & {
            *inspect.signature(made).parameters
        }


def test_rule_69_missed_cycles_are_skipped_and_warned_about() -> None:
    world = World(home=False)
    a = wild(world, "a", states=("j1/home",))
    world.switch("a")
    world.run(0.5)
    loop, numbers = world.loop, iter(range(1000))
    counted, begin = loop.statistics.cycles, world.clock.now()

    def held_up() -> None:
        if next(numbers) % 12 == 0:
            world.clock.sleep_until(world.clock.now() + 1.2 * loop.period)

    a.hooks["update"] = held_up
    cycles = world.run(1.2)
    overruns = loop.statistics.overruns
    assert overruns == 10
    due = (world.clock.now() - begin) / loop.period
    assert loop.statistics.cycles - counted == pytest.approx(due - overruns, abs=2)
    gaps = [after.time - before.time for before, after in pairwise(cycles)]
    assert min(gaps) > 0.7 * loop.period
    assert any("LATE" in warning for warning in world.supervisor.warnings)


def groups(kind: type[Checked]) -> set[type[Checked]]:
    return {kind}.union(*map(groups, kind.__subclasses__()))


@pytest.mark.parametrize("infinite", [math.inf, -math.inf, math.nan])
def test_no_number_of_any_parameter_is_infinite_but_where_that_means_unbounded(
    infinite: float,
) -> None:
    made = {controller.PARAMETERS for controller in TYPES.values()}
    assert {*made, Gains, SpeedScaling, Constraints, JointConstraints} <= groups(Checked)
    unbounded = {f"{side}_clamp_{end}" for side in "ui" for end in ("max", "min")}
    for group in groups(Checked):
        if not group.__module__.startswith("bioscara.control"):
            continue
        for each in {field.name for field in fields(group)} - unbounded:
            for value in (infinite, (infinite,), (0.0, infinite)):
                with pytest.raises(ConfigurationError, match=each):
                    group(**usable(group) | {each: value})


def usable(group: type[Checked]) -> dict[str, object]:
    """Return a value for each field of a group that needs one."""
    values = {
        "joints": ("j1",),
        "joint": "j1",
        "max_deceleration": (1.0,),
        "interface_name": "position",
    }
    needed = (each for each in fields(group) if each.default is each.default_factory is MISSING)
    return {each.name: values[each.name] for each in needed}


ASK = """
import os
from pathlib import Path
from bioscara.control.loop.realtime import realtime
from bioscara.errors import RealtimeError
def look():
    status = Path("/proc/self/status").read_text().split("VmLck:")[1].split()[0]
    return int(status) > 0, sorted(os.sched_getaffinity(0))
before = look()
try:
    with realtime():
        print(look()[0], look()[1] == before[1])
except RealtimeError:
    print("refused")
print(before[0], look() == before)
"""


def test_rule_69_priority_and_locked_memory_are_requested_and_no_processor_is_chosen() -> None:
    assert PRIORITY == 80
    assert inspect.signature(realtime).parameters["priority"].default == PRIORITY
    done = subprocess.run(
        [sys.executable, "-c", ASK], capture_output=True, text=True, check=True, env=os.environ
    )
    inside, outside = done.stdout.splitlines()
    assert inside in ("True True", "refused")
    assert outside == "False True"
