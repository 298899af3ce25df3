"""Read and check a parameter file; every complaint names file, line, key, value and limit."""

from __future__ import annotations

from pathlib import Path

from bioscara.model.checks import JOINTS, check_addresses, check_jaws, check_joint
from bioscara.model.parameters import (
    ArmParameters,
    GeometryParameters,
    GripperParameters,
    HomingParameters,
    JointParameters,
    PwmOutput,
)
from bioscara.model.yaml_section import YamlSection, read_sections

_EXISTING_ARMS = Path(__file__).with_name("parameters.yaml")


_IMPLIED = ("name", "number")


def _joint(name: str, section: YamlSection) -> JointParameters:
    section.refuse_unknown(key for key in JointParameters.__slots__ if key not in _IMPLIED)
    homing = section.section("homing")
    homing.refuse_unknown(HomingParameters.__slots__)
    return check_joint(name, section.text("unit", ("rad", "m")), section, homing)


def _gripper(section: YamlSection) -> GripperParameters:
    section.refuse_unknown(GripperParameters.__slots__)
    jaws = check_jaws(section)
    pulse_lower = section.number("pulse_lower", 1e-4, 1e-2, "s")
    pulse_upper = section.above("pulse_upper", pulse_lower, 1e-2)
    return GripperParameters(
        **jaws._asdict(),
        frequency=section.number("frequency", 1.0, 0.9 / pulse_upper, "Hz"),
        pulse_center=section.number("pulse_center", pulse_lower, pulse_upper, "s"),
        pulse_per_deg=section.nonzero("pulse_per_deg", 1e-3, "s/deg"),
        pulse_lower=pulse_lower,
        pulse_upper=pulse_upper,
        outputs=tuple(_output(output) for output in section.sections("outputs")),
    )


def _output(section: YamlSection) -> PwmOutput:
    section.refuse_unknown(PwmOutput.__slots__)
    return PwmOutput(section.text("device"), section.whole("channel", 0, 15))


def _geometry(section: YamlSection) -> GeometryParameters:
    section.refuse_unknown(GeometryParameters.__slots__)
    lengths = ("height", "upper_arm", "forearm")
    return GeometryParameters(
        **{key: section.number(key, 0.01, 2.0, "m") for key in lengths},
        **{key: section.number(key, -1.0, 1.0, "m") for key in ("tool_x", "tool_y", "tool_z")},
        tool_mass=section.number("tool_mass", 0.0, 10.0, "kg"),
    )


def _arm(top: YamlSection) -> ArmParameters:
    top.refuse_unknown(ArmParameters.__slots__)
    table = top.section("joints")
    table.refuse_unknown(JOINTS)
    sections = {name: table.section(name) for name in JOINTS}
    joints = tuple(_joint(name, section) for name, section in sections.items())
    check_addresses((joint, sections[joint.name]) for joint in joints)
    order = top.value("homing_order")
    if not isinstance(order, list) or sorted(map(str, order)) != sorted(JOINTS):
        raise top.error(
            f"homing_order: {order!r} must name each of {', '.join(JOINTS)} once", "homing_order"
        )
    return ArmParameters(
        joints,
        _geometry(top.section("geometry")),
        _gripper(top.section("gripper")),
        tuple(order),
    )


def load_parameters(path: Path | None = None) -> ArmParameters:
    """Return the arm's parameters from a YAML file, checked.

    Args:
        path: The file; None for the values of the existing arms, which come with the package
            (``parameters.yaml`` shows the form).

    Raises:
        ConfigurationError: The file cannot be read, a key is unknown or missing, or a value is
            outside its range.
    """
    if path is None:
        return _arm(read_sections(_EXISTING_ARMS, _EXISTING_ARMS.name))
    return _arm(read_sections(path, str(path)))
