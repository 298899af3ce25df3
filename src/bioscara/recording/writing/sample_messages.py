"""The samples of an owner as messages of ROS 2."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bioscara.api.messages import StateSample
from bioscara.hardware.link_frames import LinkFrames, Transform
from bioscara.recording.content import GRIPPER
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
        frames: Links of its description; None for no transforms.

    Attributes:
        jaws: True width between the jaws for the transforms [m]; None for the commanded one.
    """

    def __init__(self, names: Sequence[str], frames: LinkFrames | None) -> None:
        self._names, self._frames, self._due = names, frames, 0
        self.jaws: float | None = None
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
        # Without those of the jaws while their width is unknown.
        known = dict.fromkeys(names, 0.0)
        self._arm_transforms = _transforms(frames.at(known) if frames else ())
        self._all_transforms = _transforms(frames.at(known | {GRIPPER: 0.0}) if frames else ())

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
            if self._frames is not None and sample.cycle >= self._due:
                self._due = sample.cycle + TF_CYCLES
                jaws = width if self.jaws is None else self.jaws
                known = {**dict(zip(self._names, positions, strict=True)), GRIPPER: jaws}
                template = self._arm_transforms if math.isnan(jaws) else self._all_transforms
                rows = [
                    rounded((*each.translation, *each.rotation)) for each in self._frames.at(known)
                ]
                messages.append((Topic.TF, template.filled(stamp, rows)))
        return messages


def _pose() -> Template:
    message = CdrMessage()
    stamp = message.header(BASE)
    return Template(message, (stamp,), [(message.doubles((0.0,) * 7), 7)])


def _transforms(transforms: Sequence[Transform]) -> Template:
    message, stamps, groups = CdrMessage(), [], []
    message.uint32(len(transforms))
    for each in transforms:
        stamps.append(message.header(each.parent))
        message.string(each.child)
        groups.append((message.doubles((0.0,) * 7), 7))
    return Template(message, stamps, groups)
