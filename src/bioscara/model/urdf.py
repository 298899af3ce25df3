"""The arm as a plain URDF with its ``<ros2_control>`` tags, generated from the parameters.

No meshes and no masses: it says how the joints are stacked, how far and how fast they go, and
how the hardware is configured. ``make generate`` writes ``bioscara.urdf`` beside this file.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from bioscara.model.loading import load_parameters
from bioscara.model.parameters import (
    ArmParameters,
    GeometryParameters,
    GripperParameters,
    JointParameters,
)
from bioscara.model.tags import (
    ARM_COMMANDS,
    ARM_COMPONENT,
    ARM_STATES,
    GRIPPER_COMMANDS,
    GRIPPER_COMPONENT,
    GRIPPER_JOINT,
    GRIPPER_STATES,
    GRIPPER_TAGS,
    HOMING_TAGS,
    JOINT_TAGS,
)

URDF = Path(__file__).with_name("bioscara.urdf")
"""The generated file, which comes with the package."""


class _Frame(NamedTuple):
    """Where a link is attached: position [m] and roll, pitch, yaw [rad] in its parent."""

    joint: str
    parent: str
    child: str
    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)


def _chain(geometry: GeometryParameters) -> tuple[_Frame, ...]:
    return (
        _Frame("j1", "base_link", "link_1", (0.0, 0.0, geometry.height)),
        _Frame("j2", "link_1", "link_2", (0.0, 0.0, 0.0)),
        _Frame("j3", "link_2", "link_3", (geometry.upper_arm, 0.0, 0.0)),
        _Frame("j4", "link_3", "link_4", (geometry.forearm, 0.0, 0.0)),
    )


def _tool(geometry: GeometryParameters) -> _Frame:
    """Return the frame between the finger tips: upright in the wrist's, which the mount is not."""
    xyz = (geometry.tool_y, -geometry.tool_x, geometry.tool_z)
    return _Frame("tool", "gripper_base", "tool_link", xyz, (0.0, 0.0, -math.pi / 2.0))


_FLANGE = _Frame("flange", "link_4", "tool_flange", (0.0, 0.0, 0.0), (math.pi, 0.0, 0.0))
_MOUNT = _Frame(
    "gripper_mount",
    "tool_flange",
    "gripper_base",
    (0.0, 0.0, 0.0),
    (math.pi, 0.0, -math.pi / 2.0),
)
_JAW_VELOCITY = 1.0
"""Of the existing arms' description [m/s]."""

_TORQUE_PER_AMPERE = 0.19
"""Of a NEMA 17 motor of this length, as an effective current of both phases [N m/A]."""
_FULL_SCALE, _CURRENT_STEPS = 1.48, 32
"""Highest phase current of the board [A rms], and the steps in which it is set."""


def _effort(joint: JointParameters) -> float:
    """Return the torque [N m] or force [N] at which the motor slips, without friction."""
    step = math.ceil(0.01 * joint.drive_current_percent * (_CURRENT_STEPS - 1)) + 1
    current = _FULL_SCALE * step / _CURRENT_STEPS
    return round(_TORQUE_PER_AMPERE * math.sqrt(2.0) * current * abs(joint.reduction), 1)


def _fixed(frame: _Frame) -> list[str]:
    return _joint_tag(frame, "fixed", ())


def _joint_tag(frame: _Frame, kind: str, extra: Iterable[str]) -> list[str]:
    xyz, rpy = (" ".join(f"{number:.9g}" for number in numbers) for numbers in frame[3:])
    return [
        f'  <link name="{frame.child}"/>',
        f'  <joint name="{frame.joint}" type="{kind}">',
        f'    <parent link="{frame.parent}"/>',
        f'    <child link="{frame.child}"/>',
        f'    <origin xyz="{xyz}" rpy="{rpy}"/>',
        *(f"    {line}" for line in extra),
        "  </joint>",
    ]


def _moving(frame: _Frame, joint: JointParameters) -> list[str]:
    limit = (
        f'<limit lower="{joint.lower:.9g}" upper="{joint.upper:.9g}" '
        f'velocity="{joint.max_velocity:.9g}" effort="{_effort(joint):g}"/>'
    )
    kind = "prismatic" if joint.unit == "m" else "revolute"
    return _joint_tag(frame, kind, ('<axis xyz="0 0 1"/>', limit))


def _control(
    name: str,
    kind: str,
    plugin: str,
    joints: Iterable[tuple[str, list[tuple[str, str]]]],
    interfaces: tuple[tuple[str, ...], tuple[str, ...]],
) -> list[str]:
    lines = [
        f'  <ros2_control name="{name}" type="{kind}">',
        "    <hardware>",
        f"      <plugin>{plugin}</plugin>",
        "    </hardware>",
    ]
    commands, states = interfaces
    for joint, values in joints:
        lines.append(f'    <joint name="{joint}">')
        lines += [f'      <param name="{key}">{value}</param>' for key, value in values]
        lines += [f'      <command_interface name="{each}"/>' for each in commands]
        lines += [f'      <state_interface name="{each}"/>' for each in states]
        lines.append("    </joint>")
    return [*lines, "  </ros2_control>"]


def _joint_values(joint: JointParameters) -> list[tuple[str, str]]:
    values = [(tag, repr(getattr(joint, key))) for key, tag in JOINT_TAGS.items()]
    values[0] = (JOINT_TAGS["address"], f"{joint.address:#04x}")
    return values + [(tag, repr(getattr(joint.homing, key))) for key, tag in HOMING_TAGS.items()]


def _gripper_values(gripper: GripperParameters) -> list[tuple[str, str]]:
    return [(tag, repr(getattr(gripper, key))) for key, tag in GRIPPER_TAGS.items()]


def render(arm: ArmParameters) -> str:
    """Return the URDF of an arm."""
    gripper, chain = arm.gripper, _chain(arm.geometry)
    jaws = _Frame(GRIPPER_JOINT, _MOUNT.child, "jaw_link", (0.0, 0.0, 0.0))
    opening = (
        '<axis xyz="1 0 0"/>',
        f'<limit lower="{gripper.lower:.9g}" upper="{gripper.upper:.9g}" '
        f'velocity="{_JAW_VELOCITY:g}" effort="0"/>',
    )
    lines = [
        '<?xml version="1.0"?>',
        "<!-- Generated from parameters.yaml by bioscara.model.urdf: edit that, then make generate."
        " -->",
        '<robot name="bioscara">',
        f'  <link name="{chain[0].parent}"/>',
    ]
    for frame, joint in zip(chain, arm.joints, strict=True):
        lines += _moving(frame, joint)
    lines += [*_fixed(_FLANGE), *_fixed(_MOUNT), *_fixed(_tool(arm.geometry))]
    lines += _joint_tag(jaws, "prismatic", opening)
    lines += _control(
        ARM_COMPONENT,
        "system",
        "bioscara/ArmHardware",
        [(joint.name, _joint_values(joint)) for joint in arm.joints],
        (ARM_COMMANDS, ARM_STATES),
    )
    lines += _control(
        GRIPPER_COMPONENT,
        "actuator",
        "bioscara/GripperHardware",
        [(GRIPPER_JOINT, _gripper_values(gripper))],
        (GRIPPER_COMMANDS, GRIPPER_STATES),
    )
    return "\n".join([*lines, "</robot>", ""])


def main(arguments: list[str] | None = None) -> int:
    """Write or check the generated file; return the exit status."""
    parser = argparse.ArgumentParser(description="Generate the URDF from the arm's parameters.")
    parser.add_argument("--check", action="store_true", help="write nothing, fail when stale")
    options = parser.parse_args(arguments)
    text = render(load_parameters())
    if URDF.is_file() and URDF.read_text() == text:
        return 0
    if options.check:
        sys.stderr.write(f"{URDF.name} is stale; run python -m bioscara.model.urdf\n")
        return 1
    URDF.write_text(text)
    sys.stdout.write(f"wrote {URDF.name}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
