"""The state of each cycle as messages of ROS 2.

The messages of an arm differ by their numbers only: each is encoded once with zeros, and the
numbers are put into a copy. That takes a tenth of the time of encoding each anew.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Sequence

from bioscara.api.messages import StateSample
from bioscara.recording.cdr import CdrMessage, put_stamp
from bioscara.recording.frames import JointFrame
from bioscara.recording.topics import Topic

GRIPPER, ARM = "gripper", "arm"
"""Names of the gripper and of the arm as a whole, among those of the joints."""
JOINT_INTERFACES = ("position", "velocity", "quality", "flags", "stamp")
"""Interfaces of each joint; position and velocity in SI units, quality from 0 for fresh to 3 for
unknown, flags as in the protocol, and the time of the measurement on the arm's clock [s]."""
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
_DROP_LENGTH, _DROP_TIME = 1.5 * 2.0**26, 1.5 * 2.0**32
"""Numbers whose last digits are 2**-26 and 2**-20."""
BASE = "base_link"
"""Link in which the pose of the tool is."""


class _Template:
    """A message whose times and numbers are replaced.

    Args:
        message: The encoded message.
        stamps: Offsets of its times.
        groups: Offset and length of each group of float64.
    """

    def __init__(
        self, message: CdrMessage, stamps: Sequence[int], groups: Iterable[tuple[int, int]]
    ) -> None:
        self._data, self._stamps = message.data, stamps
        self._groups = [(struct.Struct(f"<{count}d").pack_into, at) for at, count in groups]

    def filled(self, stamp: int, groups: Sequence[Sequence[float]]) -> bytes:
        """Return the message at a time [ns] with other numbers."""
        data = self._data
        for offset in self._stamps:
            put_stamp(data, offset, stamp)
        for (put, offset), values in zip(self._groups, groups, strict=True):
            put(data, offset, *values)
        return bytes(data)


class SampleMessages:
    """Encodes the samples of an arm.

    Args:
        names: Names of its joints.
        frames: Joints of its description, with positions in the order of ``names`` and the width;
            empty for no transforms.
    """

    def __init__(self, names: Sequence[str], frames: Sequence[JointFrame]) -> None:
        self._count, self._due = len(names), 0
        self._states = _joint_states(names, velocities=True)
        self._commands = _joint_states((*names, GRIPPER), velocities=False)
        self._dynamic = _dynamic_joint_states(names)
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
        stamps = _rounded_times(sample.stamps)
        joints = zip(positions, velocities, sample.qualities, sample.flags, stamps, strict=True)
        time, late, bus_time = _rounded_times((sample.time, sample.late, sample.bus_time))
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


def rounded(values: Iterable[float]) -> list[float]:
    """Return lengths [m] and angles [rad] rounded to 2**-26, 15 nm; they compress well.

    Adding a large number drops the digits below its own last one, also of NaN and infinity.
    """
    return [(value + _DROP_LENGTH) - _DROP_LENGTH for value in values]


def _rounded_times(values: Iterable[float]) -> list[float]:
    """Return times [s] rounded to 2**-20, a microsecond."""
    return [(value + _DROP_TIME) - _DROP_TIME for value in values]


def _joint_states(names: Sequence[str], *, velocities: bool) -> _Template:
    message = CdrMessage()
    stamp, zeros = message.header(""), (0.0,) * len(names)
    message.strings(names)
    groups = [(message.double_sequence(zeros), len(names))]
    if velocities:
        groups.append((message.double_sequence(zeros), len(names)))
    else:
        message.double_sequence(())
    message.double_sequence(())
    return _Template(message, (stamp,), groups)


def _dynamic_joint_states(names: Sequence[str]) -> _Template:
    message = CdrMessage()
    stamp, groups = message.header(""), []
    message.strings((*names, GRIPPER, ARM))
    every = [JOINT_INTERFACES] * len(names) + [GRIPPER_INTERFACES, ARM_INTERFACES]
    message.uint32(len(every))
    for interfaces in every:
        message.strings(interfaces)
        offset = message.double_sequence((0.0,) * len(interfaces))
        groups.append((offset, len(interfaces)))
    return _Template(message, (stamp,), groups)


def _pose() -> _Template:
    message = CdrMessage()
    stamp = message.header(BASE)
    return _Template(message, (stamp,), [(message.doubles((0.0,) * 7), 7)])


def _transforms(frames: Sequence[JointFrame]) -> _Template:
    message, stamps, groups = CdrMessage(), [], []
    message.uint32(len(frames))
    for frame in frames:
        stamps.append(message.header(frame.parent))
        message.string(frame.child)
        groups.append((message.doubles((0.0,) * 7), 7))
    return _Template(message, stamps, groups)
