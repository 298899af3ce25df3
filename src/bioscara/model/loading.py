"""Read and check a parameter file; every complaint names file, line, key, value and limit."""

from __future__ import annotations

import difflib
import math
from pathlib import Path
from typing import Any

from bioscara.errors import ConfigurationError
from bioscara.model.parameters import (
    ArmParameters,
    GripperParameters,
    HomingParameters,
    JointParameters,
    PwmOutput,
)

_EXISTING_ARMS = Path(__file__).with_name("parameters.yaml")
_JOINTS = ("j1", "j2", "j3", "j4")
_HOMING_RPM = (1.0, 250.0)
"""Motor speeds that HOME can carry: the original host refuses the bounds themselves."""


class _Section:
    """One mapping of the file: keys are taken out of it, what is left over is refused."""

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

    def value(self, key: str) -> Any:
        if key not in self._node:
            raise self.error(f"{self.name(key)} is missing")
        return self._node[key]

    def section(self, key: str) -> _Section:
        node = self.value(key)
        return _Section(self._source, self.name(key), node, self._node.lc.key(key)[0] + 1)

    def sections(self, key: str) -> list[_Section]:
        nodes = self.value(key)
        if not isinstance(nodes, list) or not nodes:
            raise self.error(f"{self.name(key)} must be a list of mappings", key)
        lines: Any = getattr(nodes, "lc", None)
        return [
            _Section(self._source, f"{self.name(key)}[{i}]", node, lines.item(i)[0] + 1)
            for i, node in enumerate(nodes)
        ]

    def number(self, key: str, lower: float, upper: float, unit: str = "") -> float:
        value = self.value(key)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(f"{self.name(key)}: {value!r} is not a number", key)
        if not (math.isfinite(value) and lower <= value <= upper):
            text = f"{self.name(key)}: {value:g} is outside {lower:g} .. {upper:g} {unit}"
            raise self.error(text.rstrip(), key)
        return float(value)

    def whole(self, key: str, lower: int, upper: int, unit: str = "") -> int:
        value = self.number(key, lower, upper, unit)
        if not value.is_integer():
            raise self.error(f"{self.name(key)}: {value:g} is not a whole number", key)
        return int(value)

    def nonzero(self, key: str, size: float, unit: str = "") -> float:
        value = self.number(key, -size, size, unit)
        if value == 0.0:
            raise self.error(f"{self.name(key)}: it must not be zero", key)
        return value

    def text(self, key: str, allowed: tuple[str, ...] = ()) -> str:
        value = self.value(key)
        if not isinstance(value, str) or not value or (allowed and value not in allowed):
            choice = f"; it is one of {', '.join(allowed)}" if allowed else ""
            raise self.error(f"{self.name(key)}: {value!r} is not a valid name{choice}", key)
        return value

    def refuse_unknown(self, known: tuple[str, ...]) -> None:
        names = sorted(known)
        for key in self._node:
            if key in names:
                continue
            near = difflib.get_close_matches(str(key), names, 1)
            hint = f"did you mean {near[0]}?" if near else f"known here: {', '.join(names)}"
            raise self.error(f"{self.name(str(key))} is not a known parameter; {hint}", key)


def _taking(section: _Section, keys: tuple[str, ...]) -> _Section:
    """Refuse unknown keys first: a misspelt key is the better complaint than a missing one."""
    section.refuse_unknown(keys)
    return section


def _homing(section: _Section, reduction: float, max_velocity: float) -> HomingParameters:
    _taking(section, HomingParameters.__slots__)
    velocity = section.nonzero("velocity", max_velocity)
    motor_rpm = abs(math.degrees(velocity * reduction)) / 6.0
    if not _HOMING_RPM[0] < motor_rpm < _HOMING_RPM[1]:
        raise section.error(
            f"{section.name('velocity')}: {velocity:g} is {motor_rpm:g} rpm of the motor, which "
            f"must be above {_HOMING_RPM[0]:g} and below {_HOMING_RPM[1]:g}",
            "velocity",
        )
    return HomingParameters(
        velocity=velocity,
        threshold=section.whole("threshold", 1, 255, "microsteps"),
        current_percent=section.whole("current_percent", 1, 100, "%"),
        acceleration=section.number("acceleration", 1e-6, 1e3),
    )


def _joint(name: str, section: _Section) -> JointParameters:
    _taking(section, tuple(key for key in JointParameters.__slots__ if key not in _IMPLIED))
    reduction = section.nonzero("reduction", 1e5)
    lower = section.number("lower", -1e3, 1e3)
    max_velocity = section.number("max_velocity", 1e-6, 1e3)
    return JointParameters(
        name=name,
        number=_JOINTS.index(name) + 1,
        address=section.whole("address", 0x08, 0x77),
        unit=section.text("unit", ("rad", "m")),
        reduction=reduction,
        lower=lower,
        upper=_above(section, "upper", lower, 1e3),
        max_velocity=max_velocity,
        max_acceleration=section.number("max_acceleration", 1e-6, 1e4),
        drive_current_percent=section.whole("drive_current_percent", 1, 100, "%"),
        hold_current_percent=section.whole("hold_current_percent", 1, 100, "%"),
        stall_threshold=section.whole("stall_threshold", 0, 255),
        homing=_homing(section.section("homing"), reduction, max_velocity),
    )


_IMPLIED = ("name", "number")


def _above(section: _Section, key: str, lower: float, upper: float) -> float:
    value = section.number(key, -upper, upper)
    if value <= lower:
        raise section.error(f"{section.name(key)}: {value:g} must be above {lower:g}", key)
    return value


def _gripper(section: _Section) -> GripperParameters:
    _taking(section, GripperParameters.__slots__)
    lower = section.number("lower", 0.0, 1.0, "m")
    upper = _above(section, "upper", lower, 1.0)
    pulse_lower = section.number("pulse_lower", 1e-4, 1e-2, "s")
    pulse_upper = _above(section, "pulse_upper", pulse_lower, 1e-2)
    return GripperParameters(
        lower=lower,
        upper=upper,
        initial=section.number("initial", lower, upper, "m"),
        deg_per_m=section.nonzero("deg_per_m", 1e5, "deg/m"),
        zero_width=section.number("zero_width", -1.0, 1.0, "m"),
        frequency=section.number("frequency", 1.0, 0.9 / pulse_upper, "Hz"),
        pulse_center=section.number("pulse_center", pulse_lower, pulse_upper, "s"),
        pulse_per_deg=section.nonzero("pulse_per_deg", 1e-3, "s/deg"),
        pulse_lower=pulse_lower,
        pulse_upper=pulse_upper,
        outputs=tuple(_output(output) for output in section.sections("outputs")),
    )


def _output(section: _Section) -> PwmOutput:
    _taking(section, PwmOutput.__slots__)
    return PwmOutput(section.text("device"), section.whole("channel", 0, 15))


def _arm(top: _Section) -> ArmParameters:
    _taking(top, ArmParameters.__slots__)
    table = _taking(top.section("joints"), _JOINTS)
    joints = tuple(_joint(name, table.section(name)) for name in _JOINTS)
    owners: dict[int, str] = {}
    for joint in joints:
        if joint.address in owners:
            raise table.section(joint.name).error(
                f"joints.{joint.name}.address: {joint.address:#04x} is already the address of "
                f"{owners[joint.address]}",
                "address",
            )
        owners[joint.address] = joint.name
    order = top.value("homing_order")
    if not isinstance(order, list) or sorted(map(str, order)) != sorted(_JOINTS):
        raise top.error(
            f"homing_order: {order!r} must name each of {', '.join(_JOINTS)} once", "homing_order"
        )
    return ArmParameters(joints, _gripper(top.section("gripper")), tuple(order))


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
    return _arm(_Section(source, "", node, 1))


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
