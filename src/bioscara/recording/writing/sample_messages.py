"""The samples of an owner as messages of ROS 2."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bioscara.api.messages import StateSample
from bioscara.recording.content import GRIPPER
from bioscara.recording.writing.transforms import JointFrame
from bioscara.rosbag.cdr import CdrMessage
from bioscara.rosbag.joint_states import (
    ARM,
    Template,
    dynamic_joint_states,
    joint_states,
    rounded,
    rounded_times,
)
from bioscara.rosbag.topics import Topic

JOINT_INTERFACES = ("position", "velocity", "quality", "flags", "stamp", "load")
"""Interfaces of each joint; position and velocity in SI units, quality from 0 for fresh to 3 for
unknown, flags as in the protocol, the time of the measurement on the arm's clock [s], and the load
as in the samples [%], NaN where it is unknown."""
GRIPPER_INTERFACES = ("position",)
"""Of the gripper: the commanded width of the jaws [m]."""
ARM_INTERFACES = (
    "cycle",
    "time",
    "enabled",
    "paused",
    "stale",
    "speed_override",
    "late",
    "bus_time",
)
"""Of the arm: the fields of :class:`bioscara.api.messages.StateSample` of these names."""
TF_CYCLES = 10
"""Cycles from one set of transforms to the next: they follow from the positions."""
BASE = "base_link"
"""Link in which the pose of the tool is."""


class SampleMessages:
    """Encodes the samples of an arm.

    Args:
        names: Names of its joints.
        frames: Joints of its description, with positions in the order of ``names`` and the width;
            empty for no transforms.
    """

    def __init__(self, names: Sequence[str], frames: Sequence[JointFrame]) -> None:
        self._count, self._due = len(names), 0
        self._no_loads = (math.nan,) * len(names)
        self._states = joint_states(names, velocities=True)
        self._commands = joint_states((*names, GRIPPER), velocities=False)
        self._dynamic = dynamic_joint_states(
            {
                **dict.fromkeys(names, JOINT_INTERFACES),
                GRIPPER: GRIPPER_INTERFACES,
                ARM: ARM_INTERFACES,
            }
        )
        self._pose = _pose()
        moving = [frame for frame in frames if frame.source is not None]
        self._all_frames = moving
        self._arm_frames = [frame for frame in moving if frame.source != self._count]
        self._all_transforms = _transforms(self._all_frames)
        self._arm_transforms = _transforms(self._arm_frames)

    def encode(self, sample: StateSample, stamp: int) -> list[tuple[Topic, bytes]]:
        """Return the messages of a sample.

        Args:
            sample: The sample, of the arm with these joints.
            stamp: Its time [ns].
        """
        positions, velocities = rounded(sample.positions), rounded(sample.velocities)
        width = sample.width
        stamps = rounded_times(sample.stamps)
        loads = sample.loads or self._no_loads
        joints = zip(
            positions, velocities, sample.qualities, sample.flags, stamps, loads, strict=True
        )
        time, late, bus_time = rounded_times((sample.time, sample.late, sample.bus_time))
        arm = (
            sample.cycle,
            time,
            sample.enabled,
            sample.paused,
            sample.stale,
            sample.speed_override,
            late,
            bus_time,
        )
        commands = (*rounded(sample.commands), width)
        messages = [
            (Topic.JOINT_STATES, self._states.filled(stamp, (positions, velocities))),
            (
                Topic.DYNAMIC_JOINT_STATES,
                self._dynamic.filled(stamp, (*joints, (width,), arm)),
            ),
            (Topic.JOINT_COMMANDS, self._commands.filled(stamp, (commands,))),
        ]
        if (pose := sample.pose) is not None:
            half = 0.5 * pose.yaw
            place = (pose.x, pose.y, pose.z, 0.0, 0.0, math.sin(half), math.cos(half))
            messages.append((Topic.TOOL_POSE, self._pose.filled(stamp, (rounded(place),))))
            if self._arm_frames and sample.cycle >= self._due:
                self._due = sample.cycle + TF_CYCLES
                messages.append((Topic.TF, self._transforms(positions, width, stamp)))
        return messages

    def _transforms(self, positions: Sequence[float], width: float, stamp: int) -> bytes:
        known, frames, template = [*positions, width], self._all_frames, self._all_transforms
        if math.isnan(width):
            frames, template = self._arm_frames, self._arm_transforms
        return template.filled(stamp, [rounded(frame.at(known)) for frame in frames])


def _pose() -> Template:
    message = CdrMessage()
    stamp = message.header(BASE)
    return Template(message, (stamp,), [(message.doubles((0.0,) * 7), 7)])


def _transforms(frames: Sequence[JointFrame]) -> Template:
    message, stamps, groups = CdrMessage(), [], []
    message.uint32(len(frames))
    for frame in frames:
        stamps.append(message.header(frame.parent))
        message.string(frame.child)
        groups.append((message.doubles((0.0,) * 7), 7))
    return Template(message, stamps, groups)
