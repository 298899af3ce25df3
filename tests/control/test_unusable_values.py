"""Every command of the controllers and their manager, with unusable values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from bioscara import Robot
from bioscara.control.controllers.gripper_messages import GripperGoal
from bioscara.control.controllers.joint_trajectory import Goal, JointTrajectory, Point, Tolerance
from bioscara.hardware import LifecycleState
from bioscara.robot.connection.stack import GRIPPER
from control.control_stack import NAMES, World
from unusable_values import judge

Base = dict[str, Any]
FORWARD = "forward_command_controller/ForwardCommandController"
HERE = (-0.5, 0.3, 0.5, 0.5)


def test_controllers_take_a_value_or_refuse_it_and_no_cycle_fails(world: World) -> None:
    """A goal is given, and cycles run on it: no value in it may break them."""
    forward: Any = world.load("forward", FORWARD, joints=NAMES, interface_name="position")
    follow: Any = world.load(
        "follow",
        "joint_trajectory_controller/JointTrajectoryController",
        joints=NAMES,
        command_interfaces=world.commanded,
        state_interfaces=("position", "velocity"),
    )
    homing: Any = world.load(
        "homing", "single_trigger_controller/SingleTriggerController", joints=NAMES
    )
    here = tuple(world.axis(name).position.value for name in NAMES)
    point, rest = Point(60.0, here, (0.0,) * 4), (0.0,) * 4
    goal = Goal(JointTrajectory(NAMES, (point,)), (Tolerance("j1", 0.1),), (Tolerance("j1", 0.1),))
    manager, now = world.manager, world.clock.now

    def after(_: bool) -> str:
        world.loop.restart()
        world.run(0.03)
        return str(world.supervisor.faults[0]) if world.supervisor.faults else ""

    def to_point(point: object) -> None:
        follow.send_trajectory(JointTrajectory(NAMES, (point,)), now())

    groups: dict[str, dict[str, tuple[Callable[..., object], Base]]] = {
        "forward": {
            # A distant command is taken back: the joints need not follow a jump.
            "command": (
                lambda values: (forward.command(values), forward.command(here)),
                {"values": here},
            ),
        },
        "follow": {
            "send_goal": (lambda goal: follow.send_goal(goal, now()), {"goal": goal}),
            "at": (lambda time: follow.send_goal(goal, time), {"time": now()}),
            "trajectory": (
                lambda trajectory: follow.send_trajectory(trajectory, now()),
                {"trajectory": goal.trajectory},
            ),
            "point": (to_point, {"point": point}),
            "positions": (lambda values: to_point(Point(60.0, values)), {"values": here}),
            "velocities": (lambda values: to_point(Point(60.0, here, values)), {"values": rest}),
            "set_scaling": (follow.set_scaling, {"factor": 1.0}),
            "slow_down": (follow.slow_down, {"share": 1.0}),
        },
        "homing": {
            "trigger": (homing.trigger, {"joint": "j1", "command": 0.0}),
            "send_goal": (homing.send_goal, {"directions": {"j9": 1.0}}),
        },
    }
    complaints = []
    for name, calls in groups.items():
        world.switch(name)
        if name == "forward":
            for kind in (np.float32, np.float64, np.array):
                forward.command([kind(value) for value in here])
                assert after(False) == ""
        for what, (call, base) in calls.items():
            complaints += judge(f"{name}.{what}", call, base, after, share=1)
            active = manager.controller(name).state is LifecycleState.ACTIVE
            assert active, f"{name} failed in {what}: {complaints}"
        if name == "homing":
            homing.cancel()
            world.run(1.0)
        world.switch(off=(name,))
    assert complaints == [], "\n" + "\n".join(complaints)


def test_the_gripper_controller_too(tmp_path: Any) -> None:
    with Robot.simulated(evidence=tmp_path) as robot:
        robot.gripper.enable()
        stack: Any = robot.runner.arm.stack
        jaws = stack.manager.controller(GRIPPER)

        def after(_: bool) -> str:
            stack.loop.restart()
            stack.loop.step()
            stack.loop.step()
            return str(robot.faults[0]) if robot.faults else ""

        goal = GripperGoal((0.06,), (0.1,), (1.0,))
        complaints = judge("gripper", jaws.send_goal, {"goal": goal}, after, share=1)
        for what in ("position", "velocity", "effort"):
            complaints += judge(
                f"gripper {what}",
                lambda value, what=what: jaws.send_goal(
                    GripperGoal(**{"position": (0.06,), what: value})
                ),
                {"value": (0.06,)},
                after,
            )
        assert jaws.state is LifecycleState.ACTIVE
    assert complaints == [], "\n" + "\n".join(complaints)


def test_the_manager_too(world: World) -> None:
    world.load("forward", FORWARD, joints=NAMES, interface_name="position")
    manager, now = world.manager, world.clock.now()
    table: dict[str, tuple[Callable[..., object], Base]] = {
        "controller": (manager.controller, {"name": "forward"}),
        "load": (
            manager.load,
            {
                "name": "forward",
                "kind": FORWARD,
                "values": {"joints": NAMES, "interface_name": "position"},
            },
        ),
        "configure": (manager.configure, {"name": "other"}),
        "cleanup": (manager.cleanup, {"name": "other"}),
        "unload": (manager.unload, {"name": "other"}),
        "switch": (
            manager.switch,
            {"time": now, "activate": ("other",), "deactivate": ("other",), "strictness": 2},
        ),
        "take_over": (manager.take_over, {"name": "other", "leaving": (), "time": now}),
        "set_hardware_state": (
            manager.set_hardware_state,
            {"name": "other", "state": LifecycleState.INACTIVE, "time": now},
        ),
        "cycle": (manager.cycle, {"time": now, "period": 0.01}),
    }
    complaints = [
        complaint
        for name, (call, base) in table.items()
        for complaint in judge(f"manager.{name}", call, base, share=1)
    ]
    assert complaints == [], "\n" + "\n".join(complaints)
