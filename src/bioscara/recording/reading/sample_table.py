"""The samples of a recording as tables of numbers, some thousands of rows at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from bioscara.errors import RecordingError
from bioscara.planning.arrays import Array
from bioscara.recording.reading.scan import FileScan, messages
from bioscara.rosbag.cdr import CdrReader
from bioscara.rosbag.topics import Topic

BATCH = 10_000
"""Rows of a table."""
TIME = "time"
"""Name of the first column: seconds since 1970."""
_POSE = {"tool_x": 0, "tool_y": 8, "tool_z": 16}
_SECOND = 1e-9
_TOPICS = (Topic.DYNAMIC_JOINT_STATES, Topic.JOINT_COMMANDS, Topic.TOOL_POSE)


class _Layout:
    """Where the numbers are in the messages of a topic, which differ by their numbers only."""

    def __init__(self, topic: str, first: bytes) -> None:
        self._topic, self.size = topic, len(first)
        reader = CdrReader(first)
        reader.stamp()
        reader.string()
        self.offsets = _OFFSETS[topic](reader)

    def columns(self, stored: list[bytes]) -> dict[str, Array]:
        """Return the numbers of messages as columns; those of an empty message are unknown.

        Raises:
            RecordingError: A message has another size, as after a change of the joints.
        """
        blank = np.full(self.size, 0xFF, np.uint8).tobytes()  # bytes of a NaN
        filled = [each or blank for each in stored]
        if any(len(each) != self.size for each in filled):
            raise RecordingError(f"the joints in {self._topic} change within the recording")
        table = np.frombuffer(b"".join(filled), np.uint8).reshape(len(stored), self.size)
        return {
            name: np.ascontiguousarray(table[:, at : at + 8]).view("<f8")[:, 0]
            for name, at in self.offsets.items()
        }


def _of_interfaces(reader: CdrReader) -> dict[str, int]:
    offsets = {}
    joints = reader.strings()
    if reader.uint32() != len(joints):
        raise RecordingError("a message has not as many joints as names")
    for joint in joints:
        names, (begin, count) = reader.strings(), reader.doubles()
        if count != len(names):
            raise RecordingError(f"{joint} has not as many values as interfaces")
        for index, name in enumerate(names):
            offsets[f"{joint}_{name}"] = begin + 8 * index
    return offsets


def _of_commands(reader: CdrReader) -> dict[str, int]:
    names, offsets = reader.strings(), dict[str, int]()
    for kind in ("command", "velocity_command"):
        begin, count = reader.doubles()
        offsets |= {f"{name}_{kind}": begin + 8 * i for i, name in enumerate(names[:count])}
    return offsets


def _of_pose(reader: CdrReader) -> dict[str, int]:
    begin = reader.align(8, 56)
    return {
        **{name: begin + offset for name, offset in _POSE.items()},
        "sine": begin + 40,
        "cosine": begin + 48,
    }


_OFFSETS: dict[str, Callable[[CdrReader], dict[str, int]]] = {
    Topic.DYNAMIC_JOINT_STATES: _of_interfaces,
    Topic.JOINT_COMMANDS: _of_commands,
    Topic.TOOL_POSE: _of_pose,
}


def sample_tables(path: Path, scan: FileScan) -> Iterator[Mapping[str, Array]]:
    """Yield the samples of a recording as columns, by name; unknown numbers are NaN.

    The columns are :data:`TIME`, then ``<joint>_<interface>`` of all joints, the gripper and the
    arm, ``<joint>_command``, in flight records ``<joint>_velocity_command`` as well, and the pose
    of the tool ``tool_x``, ``tool_y``, ``tool_z`` [m] and ``tool_yaw`` [rad].

    Args:
        path: The recording.
        scan: Takes the rest of the content; a new one.

    Raises:
        RecordingError: It cannot be read, is no recording, or its joints change.
    """
    layouts: dict[str, _Layout] = {}
    times: list[int] = []
    stored: dict[str, list[bytes]] = {topic: [] for topic in _TOPICS}
    for message in messages(path, scan, _TOPICS):
        topic = message.channel.topic
        if topic not in layouts:
            layouts[topic] = _Layout(topic, message.data)
        if topic == Topic.DYNAMIC_JOINT_STATES:
            if len(times) == BATCH:
                yield _table(times, stored, layouts)
                times, stored = [], {each: [] for each in _TOPICS}
            times.append(message.log_time)
            for column in stored.values():
                column.append(b"")
        if times and message.log_time == times[-1]:
            stored[topic][-1] = message.data
    if times:
        yield _table(times, stored, layouts)


def _table(
    times: list[int], stored: dict[str, list[bytes]], layouts: dict[str, _Layout]
) -> dict[str, Array]:
    columns: dict[str, Array] = {TIME: np.array(times, dtype=np.float64) * _SECOND}
    for topic in _TOPICS:
        if topic in layouts:
            columns |= layouts[topic].columns(stored[topic])
    unknown = np.full(len(times), np.nan)
    columns |= {name: columns.pop(name, unknown) for name in _POSE}
    yaw = 2.0 * np.arctan2(columns.pop("sine", unknown), columns.pop("cosine", unknown))
    return {**columns, "tool_yaw": yaw}
