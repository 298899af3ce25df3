"""The small controllers, on the compiled firmware."""

from __future__ import annotations

import math

import pytest

from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.controllers.hold_controller import HoldController
from bioscara.control.controllers.homing_controller import HomingController
from bioscara.control.controllers.joint_state_broadcaster import (
    DynamicJointState,
    JointStateBroadcaster,
)
from bioscara.control.limits.limiter import Limiter, joint_limiters
from bioscara.control.manager.manager import ControllerManager
from bioscara.drivers import Quality
from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.hardware import LifecycleState
from control.control_stack import LIMITS, NAMES, World
from control.scripted_controller import Box
from simulated import home_error

HOLD = HoldController.TYPE
FORWARD = ForwardCommandController.TYPE
BROADCASTER = JointStateBroadcaster.TYPE


def forward(world: World, name: str, kind: str, *joints: str) -> ForwardCommandController:
    controller = world.load(name, FORWARD, joints=joints, interface_name=kind)
    assert isinstance(controller, ForwardCommandController)
    return controller


def broadcaster(world: World, **values: object) -> JointStateBroadcaster:
    controller = world.load("jsb", BROADCASTER, joints=NAMES, **values)
    assert isinstance(controller, JointStateBroadcaster)
    return controller


@pytest.mark.parametrize("v1", [False, True])
def test_forward_changes_nothing_until_it_gets_a_command_and_then_follows_it(v1: bool) -> None:
    world = World(at={"j1": 0.0}, v1=v1)
    controller = forward(world, "fwd", "position", "j1")
    world.switch("fwd")
    start = world.arm.position("j1")
    world.run(0.5)
    assert world.arm.position("j1") == pytest.approx(start, abs=2e-3)
    controller.command([0.3])
    world.run(2.5)
    error = 5e-3 + home_error("j1", v1=v1)
    assert world.arm.position("j1") == pytest.approx(0.3, abs=error)
    world.switch(off=("fwd",))
    world.switch("fwd")
    world.run(0.3)
    assert world.arm.position("j1") == pytest.approx(0.3, abs=error)


@pytest.mark.parametrize(
    ("kind", "v1"), [(kind, v1) for kind in ("position", "velocity") for v1 in (False, True)]
)
def test_forward_brings_a_moving_joint_to_rest_until_it_gets_a_command(kind: str, v1: bool) -> None:
    world = World(at={"j1": -2.0}, v1=v1)
    moving = forward(world, "moving", "velocity", "j1")
    world.switch("moving")
    moving.command([0.5])
    world.run(1.0)
    before = world.arm.position("j1")
    forward(world, kind, kind, "j1")
    world.switch(kind, off=("moving",))
    world.run(2.0)
    rest = world.arm.position("j1")
    assert rest == pytest.approx(before, abs=0.2)
    world.run(2.0)
    assert world.arm.position("j1") == pytest.approx(rest, abs=2e-3)
    if kind == "velocity":
        assert world.axis("j1").velocity_command.value == 0.0
    assert world.supervisor.faults == []


@pytest.mark.parametrize("velocity", [1.0, -1.0])
def test_a_velocity_ends_before_the_limit_and_no_fault_does(velocity: float) -> None:
    world = World(at={"j1": 2.0 * velocity})
    limits = LIMITS["j1"]
    controller = forward(world, "fwd", "velocity", "j1")
    world.switch("fwd")
    controller.command([velocity])
    for cycle in world.run(4.0):
        assert cycle.period > 0.0
        assert limits.lower < world.axis("j1").position.value < limits.upper
    assert world.supervisor.faults == []
    end = limits.upper if velocity > 0.0 else limits.lower
    assert abs(world.arm.position("j1") - end) < 0.05
    controller.command([-velocity])
    world.run(0.5)
    assert abs(world.arm.position("j1") - end) > 0.1


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ([0.0], r"1 values for the joints j1, j2"),
        ([0.0, math.nan], r"j2 position is nan, which is not a finite number"),
        ([math.inf, 0.0], r"j1 position is inf, which is not a finite number"),
    ],
)
def test_forward_refuses_what_it_cannot_pass_on(values: list[float], text: str) -> None:
    world = World(home=False)
    controller = forward(world, "fwd", "position", "j1", "j2")
    with pytest.raises(InvalidArgumentError, match=text):
        controller.command(values)


def test_bad_parameters_are_refused() -> None:
    world = World(home=False)
    for kind, values, text in (
        (FORWARD, {"joints": (), "interface_name": "position"}, "joints names none"),
        (FORWARD, {"joints": ("j1",), "interface_name": "effort"}, "interface_name: 'effort'"),
        (FORWARD, {"joints": ("j1",)}, "interface_name is missing"),
        (HOLD, {"joints": ("j1",), "max_deceleration": ()}, "0 max_deceleration for 1 joints"),
        (HOLD, {"joints": ("j1",), "max_deceleration": (0.0,)}, "max_deceleration"),
        (HOLD, {"joints": ("j1",), "max_deceleration": (math.nan,)}, "max_deceleration"),
        (BROADCASTER, {"joints": ()}, "joints names none"),
        (BROADCASTER, {"joints": ("j1",), "extra_joints": ("j1",)}, "j1 is named twice"),
    ):
        with pytest.raises(ConfigurationError, match=text):
            world.load(f"{kind} {text}", kind, **values)


def test_hold_brings_all_joints_to_rest_together_on_their_path() -> None:
    world = World(at={"j1": -1.0, "j2": 0.2, "j3": 0.0, "j4": -1.0})
    both = forward(world, "fwd", "velocity", "j1", "j4")
    world.switch("fwd")
    both.command([0.8, 2.0])
    world.run(1.0)
    world.switch("hold", off=("fwd",))
    hold = world.manager.controller("hold")
    assert isinstance(hold, HoldController)
    assert not hold.ended
    shares: list[float] = []
    while not hold.ended:
        guards = world.manager.limiter.joints
        if abs(guards["j1"].speed) > 1e-3:
            shares.append(guards["j4"].speed / guards["j1"].speed)
        world.run(0.01)
    assert shares[2:-2] == pytest.approx([2.5] * len(shares[2:-2]), rel=0.03)
    rest = world.arm.position("j1")
    world.run(1.0)
    assert world.arm.position("j1") == pytest.approx(rest, abs=0.02)


def test_after_homing_a_joint_starts_from_where_it_is_not_from_where_it_was_before() -> None:
    world = World(at={"j1": -2.8})
    world.load("homing", HomingController.TYPE, joints=NAMES)
    homing = world.manager.controller("homing")
    assert isinstance(homing, HomingController)
    world.switch("homing")
    goal = homing.send_goal({"j1": -1.0})
    world.run_until(lambda: goal.done)
    assert world.supervisor.faults == []
    here = world.arm.position("j1")
    assert here < -3.0
    world.switch("hold", off=("homing",))
    world.run(1.0)
    assert world.arm.position("j1") == pytest.approx(here, abs=5e-3)
    assert world.supervisor.faults == []


def test_rule_70_all_joints_are_published_extra_joints_as_0_and_none_while_inactive() -> None:
    world = World(at={"j1": 0.3})
    controller = broadcaster(world, extra_joints=("gripper",))
    assert controller.states is None
    assert controller.dynamic_states == ()
    world.switch("jsb")
    world.run(0.05)
    states = controller.states
    assert states is not None
    assert states.names == (*NAMES, "gripper")
    assert {len(field) for field in states[1:]} == {5}
    assert len(set(states.stamps[:4])) == 4  # The bus polls the joints one after the other.
    for index, name in enumerate(NAMES):
        assert states.positions[index] == pytest.approx(world.arm.position(name), abs=5e-3)
        assert abs(states.time - states.stamps[index]) < 0.011
        assert states.stamps[index] == world.hardware.states[f"{name}/position"].stamp
    assert (states.positions[4], states.velocities[4]) == (0.0, 0.0)
    assert set(states.qualities) == {Quality.FRESH}
    dynamic = {each.joint: each for each in controller.dynamic_states}
    assert tuple(dynamic) == NAMES
    assert dynamic["j1"].interfaces == ("position", "velocity", "home")
    assert dynamic["j1"].values == (states.positions[0], states.velocities[0], 1.0)
    world.switch(off=("jsb",))
    assert controller.states is None
    assert controller.dynamic_states == ()


def test_rule_70_unknown_and_missing_values_are_nan() -> None:
    world, box = World(home=False), Box()
    manager = ControllerManager(
        (world.hardware, box), Limiter(joint_limiters((world.hardware, box))), 100
    )
    manager.load("jsb", BROADCASTER, {"joints": ("j1", "g")})
    manager.configure("jsb")
    manager.switch(world.clock.now(), ("jsb",))
    manager.cycle(world.clock.now(), 0.01)
    controller = manager.controller("jsb")
    assert isinstance(controller, JointStateBroadcaster)
    assert controller.states is not None
    unhomed, box_position = controller.states.positions
    assert math.isnan(unhomed)
    assert box_position == 0.25
    assert math.isnan(controller.states.velocities[1])
    assert controller.states.qualities[0] is Quality.UNKNOWN
    dynamic = controller.dynamic_states
    assert dynamic[0].values[2] == 0.0
    assert dynamic[1].interfaces == ("position", "switch")
    manager.set_hardware_state("box", LifecycleState.UNCONFIGURED, world.clock.now())
    assert controller.state is LifecycleState.INACTIVE


def test_rule_70_a_joint_with_a_single_interface_is_published() -> None:
    box = Box()
    del box.states["g/switch"]
    manager = ControllerManager((box,), Limiter(joint_limiters((box,))), 100)
    manager.load("jsb", BROADCASTER, {"joints": ("g",)})
    manager.configure("jsb")
    manager.switch(0.0, ("jsb",))
    manager.cycle(0.0, 0.01)
    controller = manager.controller("jsb")
    assert isinstance(controller, JointStateBroadcaster)
    assert controller.dynamic_states == (DynamicJointState("g", ("position",), (0.25,)),)
