"""Read and check a parameter file; every error names file, line, key, value and limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from bioscara.model.checks import (
    JOINTS,
    UNITS,
    check_addresses,
    check_jaws,
    check_joint,
    check_reach,
)
from bioscara.model.parameters import (
    HIGHEST_RATE,
    LOWEST_RATE,
    ArmParameters,
    ControllerSettings,
    GeometryParameters,
    GripperParameters,
    GripperSettings,
    HoldSettings,
    HomingParameters,
    HomingSettings,
    JointParameters,
    JointTolerances,
    PwmOutput,
    TrajectoryConstraints,
    TrajectorySettings,
    UpdateRates,
)
from bioscara.model.section import described
from bioscara.model.yaml_section import YamlSection, read_sections

_EXISTING_ARMS = Path(__file__).with_name("parameters.yaml")
_IMPLIED = ("name", "number")
_CARRIAGE = 0.16
"""Shortest upper arm [m]: the lift's carriage extends to there, and the elbow is beyond it."""
_BRAKING_SHARE = (0.01, 1.0)

_SLOWEST_BELT = 1.0
"""Longest period of a belt [s]: a load with a slower oscillation cannot be positioned."""


def _joint(name: str, section: YamlSection) -> JointParameters:
    section.refuse_unknown(key for key in JointParameters.__slots__ if key not in _IMPLIED)
    homing = section.section("homing")
    homing.refuse_unknown(HomingParameters.__slots__)
    section.text("unit", (UNITS[name],))
    # Not in the description, which covers the hardware: only planning uses the belts.
    period = section.number("belt_period", 0.0, _SLOWEST_BELT, "s")
    return replace(check_joint(name, section, homing), belt_period=period)


def _gripper(section: YamlSection) -> GripperParameters:
    section.refuse_unknown(GripperParameters.__slots__)
    jaws = check_jaws(section)
    pulse_lower = section.number("pulse_lower", 1e-4, 1e-2, "s")
    pulse_upper = section.above("pulse_upper", pulse_lower, 1e-2)
    gripper = GripperParameters(
        **jaws._asdict(),
        max_velocity=section.number("max_velocity", 1e-3, 10.0, "m/s"),
        frequency=section.number("frequency", 1.0, 0.9 / pulse_upper, "Hz"),
        pulse_center=section.number("pulse_center", pulse_lower, pulse_upper, "s"),
        pulse_per_deg=section.nonzero("pulse_per_deg", 1e-3, "s/deg"),
        pulse_lower=pulse_lower,
        pulse_upper=pulse_upper,
        outputs=tuple(_output(output) for output in section.sections("outputs")),
    )
    return check_reach(section, gripper)


def _output(section: YamlSection) -> PwmOutput:
    section.refuse_unknown(PwmOutput.__slots__)
    return PwmOutput(section.text("device"), section.whole("channel", 0, 15))


def _geometry(section: YamlSection) -> GeometryParameters:
    section.refuse_unknown(GeometryParameters.__slots__)
    return GeometryParameters(
        height=section.number("height", 0.01, 2.0, "m"),
        upper_arm=section.number("upper_arm", _CARRIAGE, 2.0, "m"),
        forearm=section.number("forearm", 0.01, 2.0, "m"),
        tool_x=section.number("tool_x", -1.0, 1.0, "m"),
        tool_y=section.number("tool_y", -1.0, 1.0, "m"),
        tool_z=section.number("tool_z", -1.0, 1.0, "m"),
        tool_mass=section.number("tool_mass", 0.0, 10.0, "kg"),
    )


def _controllers(top: YamlSection, joints: Sequence[JointParameters]) -> ControllerSettings:
    top.refuse_unknown(ControllerSettings.__slots__)
    rate = top.section("update_rate")
    rate.refuse_unknown(UpdateRates.__slots__)
    homing = top.section("homing_controller")
    homing.refuse_unknown(HomingSettings.__slots__)
    hold = top.section("hold_controller")
    hold.refuse_unknown(HoldSettings.__slots__)
    return ControllerSettings(
        update_rate=UpdateRates(
            version_1=rate.whole("version_1", LOWEST_RATE, HIGHEST_RATE, "Hz"),
            version_2=rate.whole("version_2", LOWEST_RATE, HIGHEST_RATE, "Hz"),
        ),
        joint_trajectory_controller=_trajectory(top.section("joint_trajectory_controller"), joints),
        homing_controller=HomingSettings(
            timeout=homing.number("timeout", 1.0, 3600.0, "s"),
            max_travel_share=homing.number("max_travel_share", 1.0, 2.0),
        ),
        hold_controller=HoldSettings(hold.number("max_deceleration_share", *_BRAKING_SHARE)),
        gripper_controller=_gripper_controller(top.section("gripper_controller")),
    )


def _trajectory(section: YamlSection, joints: Sequence[JointParameters]) -> TrajectorySettings:
    section.refuse_unknown(TrajectorySettings.__slots__)
    limits = section.section("constraints")
    own = (key for key in TrajectoryConstraints.__slots__ if key != "joints")
    limits.refuse_unknown((*own, *JOINTS))
    return TrajectorySettings(
        allow_partial_joints_goal=section.flag("allow_partial_joints_goal"),
        allow_nonzero_velocity_at_trajectory_end=section.flag(
            "allow_nonzero_velocity_at_trajectory_end"
        ),
        constraints=TrajectoryConstraints(
            stopped_velocity_tolerance=limits.number("stopped_velocity_tolerance", 0.0, 10.0),
            goal_time=limits.number("goal_time", 0.0, 3600.0, "s"),
            max_deceleration_on_cancel_share=limits.number(
                "max_deceleration_on_cancel_share", *_BRAKING_SHARE
            ),
            joints=tuple(_tolerances(limits.section(joint.name), joint) for joint in joints),
        ),
    )


def _tolerances(section: YamlSection, joint: JointParameters) -> JointTolerances:
    section.refuse_unknown(JointTolerances.__slots__)
    # A tolerance above the joint's range can never be violated.
    span = joint.upper - joint.lower
    return JointTolerances(
        trajectory=section.number("trajectory", 0.0, span, joint.unit),
        goal=section.number("goal", 0.0, span, joint.unit),
    )


def _gripper_controller(section: YamlSection) -> GripperSettings:
    section.refuse_unknown(GripperSettings.__slots__)
    return GripperSettings(
        goal_tolerance=section.number("goal_tolerance", 1e-5, 0.1, "m"),
        allow_stalling=section.flag("allow_stalling"),
        stall_velocity_threshold=section.number("stall_velocity_threshold", 1e-6, 1.0, "m/s"),
        stall_timeout=section.number("stall_timeout", 0.01, 60.0, "s"),
    )


def _arm(top: YamlSection) -> ArmParameters:
    top.refuse_unknown(ArmParameters.__slots__)
    table = top.section("joints")
    table.refuse_unknown(JOINTS)
    sections = {name: table.section(name) for name in JOINTS}
    joints = tuple(_joint(name, section) for name, section in sections.items())
    check_addresses((joint, sections[joint.name]) for joint in joints)
    order = top.value("homing_order")
    names = isinstance(order, list) and all(isinstance(name, str) for name in order)
    if not names or sorted(order) != sorted(JOINTS):
        raise top.error(
            f"homing_order: {described(order)} must name each of {', '.join(JOINTS)} once",
            "homing_order",
        )
    return ArmParameters(
        joints,
        _geometry(top.section("geometry")),
        _gripper(top.section("gripper")),
        tuple(order),
        _controllers(top.section("controllers"), joints),
    )


def load_parameters(path: Path | None = None) -> ArmParameters:
    """Return the arm's parameters from a YAML file, checked.

    Args:
        path: The file; None for the values of the existing arms, which come with the package
            (``parameters.yaml`` is an example).

    Raises:
        ConfigurationError: The file cannot be read, a key is unknown or missing, or a value is
            outside its range.
    """
    if path is None:
        return _arm(read_sections(_EXISTING_ARMS, _EXISTING_ARMS.name))
    return _arm(read_sections(path, str(path)))
