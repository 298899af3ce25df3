"""Every command of the drivers, with values that no joint and no servo can use."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from operator import attrgetter
from pathlib import Path
from typing import Any

import pytest

from bioscara.drivers import Gripper, Joint, Pwm, Setpoint, calibrate, drive, track
from bioscara.drivers.joint.limits import SetpointLimits
from bioscara.drivers.joint.settings import Settings
from bioscara.model import load_parameters
from bioscara.protocol import BrakeMode, Flags
from bioscara.sim import SimulatedServo
from simulated import World
from unusable_values import judge

ARM = load_parameters()
Base = dict[str, Any]


def commands(joint: Any) -> dict[str, Base]:
    """Return the commands of a joint with arguments that cause no large motion."""
    parameters, here = joint.parameters, joint.get_position()
    callbacks: Base = {"progress": lambda _: None, "cancel": lambda: False}
    seek = parameters.homing
    homing: Base = {
        "velocity": seek.velocity,
        "sensitivity": seek.threshold,
        "current": seek.current_percent,
    }
    return {
        "feedback.store_offset": {"offset": joint.feedback.read_offset()},
        "clear_fault": {"fault": "STALL"},
        "settings.set_drive_current": {"percent": parameters.drive_current_percent},
        "settings.set_hold_current": {"percent": parameters.hold_current_percent},
        "settings.set_brake_mode": {"mode": BrakeMode.FREEWHEEL},
        "set_max_acceleration": {"acceleration": parameters.max_acceleration},
        "set_max_velocity": {"velocity": parameters.max_velocity},
        "settings.set_max_acceleration": {"acceleration": parameters.max_acceleration},
        "settings.set_max_velocity": {"velocity": parameters.max_velocity},
        "settings.enable_stallguard": {"threshold": parameters.stall_threshold},
        "settings.check_acceleration": {"acceleration": parameters.max_acceleration},
        "limits.check_setpoint": {"setpoint": Setpoint(here, 0.0)},
        "limits.check_position": {"position": here},
        "limits.check_velocity": {"velocity": 0.0},
        "limits.start_from": {"position": here},
        "enable": {"drive_percent": 50, "hold_percent": 50},
        "stop": {"hard": False},
        "set_position": {"position": here},
        "set_velocity": {"velocity": 0.0},
        "move_steps": {"steps": 0, **callbacks},
        "check_orientation": {"motor_angle": 0.01},
        "track": {"position": here, "velocity": 0.0},
        "home": {**homing, **callbacks},
        "start_homing": homing,
    }


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_a_joint_takes_a_value_or_refuses_it_and_stays_usable(v1: bool) -> None:
    world = World(v1=v1)
    world.ready()
    parameters = ARM.joints[2]
    joint: Any = world.joint(parameters)
    joint.init()
    joint.enable()
    complaints = []
    for name, base in commands(joint).items():
        before = world.arm.position(joint.name)

        def after(refused: bool, name: str = name) -> str:
            nonlocal before
            world.arm.run(0.2)
            was, now = before, world.arm.position(joint.name)
            if v1:  # A command accepted before continues autonomously.
                joint.stop()
                world.arm.run(0.5)
            before = world.arm.position(joint.name)
            moved = refused and abs(now - was) > 1e-2 and "home" not in name
            return f"it moved from {was} to {now}" if moved else ""

        def call(name: str = name, **values: object) -> None:
            if joint.readiness.blocking:
                joint.stop()
            if joint.version == 2 and joint.get_flags() & Flags.FAULT:
                joint.clear_fault()
            if joint.get_flags() & Flags.NOTENABLED:
                joint.enable()
            attrgetter(name)(joint)(**values)

        complaints += judge(f"Joint.{name}", call, base, after)
    joint.stop()
    world.arm.run(2.0)
    if joint.version == 2 and joint.get_flags() & Flags.FAULT:
        joint.clear_fault()
    joint.enable()
    if not joint.is_homed():
        joint.home()
    joint.set_position(joint.get_position())
    assert complaints == [], "\n" + "\n".join(complaints)


def test_every_command_of_a_joint_is_in_the_table() -> None:
    world = World()
    world.ready()
    joint = world.joint(ARM.joints[2])
    joint.init()
    table = commands(joint)
    inside = {"limits.check_stopping", "enabling", "starting_homing"}  # called by the package
    missing = [
        f"{part}{name}({parameter})"
        for part, kind in (("", Joint), ("settings.", Settings), ("limits.", SetpointLimits))
        for name, member in inspect.getmembers(kind, inspect.isfunction)
        for parameter in set(inspect.signature(member).parameters) - {"self"}
        if not name.startswith("_")
        and part + name not in inside
        and parameter not in table.get(part + name, {})
    ]
    assert missing == []


def test_setpoints_and_velocities_of_several_joints_too() -> None:
    world = World()
    world.ready()
    joints = [world.joint(parameters) for parameters in ARM.joints]
    for joint in joints:
        joint.init()
        joint.enable()
    here = [Setpoint(joint.get_position(), 0.0) for joint in joints]
    complaints = judge("track", lambda setpoints: track(joints, setpoints), {"setpoints": here})
    for index in range(4):
        complaints += judge(
            f"track joint {index}",
            lambda setpoint, index=index: track(
                joints, [*here[:index], setpoint, *here[index + 1 :]]
            ),
            {"setpoint": here[index]},
        )
    complaints += judge(
        "drive", lambda velocities: drive(joints, velocities), {"velocities": [0.0] * 4}
    )
    assert complaints == [], "\n" + "\n".join(complaints)


def test_the_gripper_and_its_output_too(tmp_path: Path) -> None:
    clock = World().arm.clock
    with SimulatedServo(ARM.gripper.outputs[0]) as servo:
        pwm = Pwm(ARM.gripper.outputs, clock, servo.root)
        gripper = Gripper(pwm, ARM.gripper, tmp_path / "width")
        gripper.enable()
        table: dict[str, tuple[Callable[..., object], Base]] = {
            "set_width": (gripper.set_width, {"width": 0.06}),
            "command_width": (gripper.command_width, {"width": 0.06}),
            "store_width": (gripper.store_width, {"width": 0.06}),
            "set_servo_angle": (gripper.set_servo_angle, {"angle_deg": 1.0}),
            "start": (pwm.start, {"period": 0.02, "pulse": 0.0015}),
            "set_pulse": (pwm.set_pulse, {"pulse": 0.0015}),
            "calibrate": (
                lambda first, second: calibrate(ARM.gripper, first, second),
                {"first": (0.0, 0.05), "second": (20.0, 0.06)},
            ),
        }
        complaints = [
            complaint
            for name, (call, base) in table.items()
            for complaint in judge(name, call, base)
        ]
        gripper.set_width(0.06)
    assert complaints == [], "\n" + "\n".join(complaints)
