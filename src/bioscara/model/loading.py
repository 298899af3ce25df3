"""Read and check a parameter file; every complaint names file, line, key, value and limit."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from bioscara.errors import ConfigurationError
from bioscara.model.checks import JOINTS, Section, check_addresses, check_jaws, check_joint
from bioscara.model.parameters import (
    ArmParameters,
    GeometryParameters,
    GripperParameters,
    HomingParameters,
    JointParameters,
    PwmOutput,
)

_EXISTING_ARMS = Path(__file__).with_name("parameters.yaml")


class _Mapping(Section):
    """One mapping of the file."""

    def __init__(self, source: str, where: str, node: Any, line: int) -> None:
        self._source, self._where, self._line = source, where, line
        if not isinstance(node, dict):
            raise self.error(f"{where or 'the file'} must be a mapping of names to values")
        self._node: Any = node

    def error(self, text: str, key: str | None = None) -> ConfigurationError:
        line = self._line
        if key is not None and key in self._node:
            line = self._node.lc.key(key)[0] + 1
        return ConfigurationError(f"{self._source}, line {line}: {text}")

    def name(self, key: str) -> str:
        return f"{self._where}.{key}" if self._where else key

    def keys(self) -> Iterable[str]:
        return tuple(self._node)

    def value(self, key: str) -> Any:
        if key not in self._node:
            raise self.error(f"{self.name(key)} is missing")
        return self._node[key]

    def section(self, key: str) -> _Mapping:
        node = self.value(key)
        return _Mapping(self._source, self.name(key), node, self._node.lc.key(key)[0] + 1)

    def sections(self, key: str) -> list[_Mapping]:
        nodes = self.value(key)
        if not isinstance(nodes, list) or not nodes:
            raise self.error(f"{self.name(key)} must be a list of mappings", key)
        lines: Any = getattr(nodes, "lc", None)
        return [
            _Mapping(self._source, f"{self.name(key)}[{i}]", node, lines.item(i)[0] + 1)
            for i, node in enumerate(nodes)
        ]


_IMPLIED = ("name", "number")


def _joint(name: str, section: _Mapping) -> JointParameters:
    section.refuse_unknown(key for key in JointParameters.__slots__ if key not in _IMPLIED)
    homing = section.section("homing")
    homing.refuse_unknown(HomingParameters.__slots__)
    return check_joint(name, section.text("unit", ("rad", "m")), section, homing)


def _gripper(section: _Mapping) -> GripperParameters:
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


def _output(section: _Mapping) -> PwmOutput:
    section.refuse_unknown(PwmOutput.__slots__)
    return PwmOutput(section.text("device"), section.whole("channel", 0, 15))


def _geometry(section: _Mapping) -> GeometryParameters:
    section.refuse_unknown(GeometryParameters.__slots__)
    lengths = [section.number(key, 0.01, 2.0, "m") for key in ("height", "upper_arm", "forearm")]
    tool = [section.number(key, -1.0, 1.0, "m") for key in ("tool_x", "tool_y", "tool_z")]
    return GeometryParameters(*lengths, *tool)


def _arm(top: _Mapping) -> ArmParameters:
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


def _parse(text: str, source: str) -> ArmParameters:
    # Only who reads a file pays for the parser.
    from ruamel.yaml import YAML  # noqa: PLC0415
    from ruamel.yaml.error import MarkedYAMLError, YAMLError  # noqa: PLC0415

    try:
        node = YAML(typ="rt").load(text)
    except MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise ConfigurationError(f"{source}, line {line}: {error.problem}") from error
    except YAMLError as error:
        raise ConfigurationError(f"{source}: not a YAML file: {error}") from error
    return _arm(_Mapping(source, "", node, 1))


def load_parameters(path: Path | None = None) -> ArmParameters:
    """Return the arm's parameters from a YAML file, checked.

    Args:
        path: The file; None for the values of the existing arms, which come with the package
            (``parameters.yaml`` shows the form).

    Raises:
        ConfigurationError: The file cannot be read, a key is unknown or missing, or a value is
            outside its range.
    """
    file = path if path is not None else _EXISTING_ARMS
    source = str(path) if path is not None else file.name
    try:
        text = file.read_bytes().decode()
    except OSError as error:
        raise ConfigurationError(f"{source}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{source}: not a text file: {error}") from error
    return _parse(text, source)
