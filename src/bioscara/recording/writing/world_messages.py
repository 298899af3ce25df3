"""The bodies around a simulated arm as messages of ROS 2: transforms, markers, and JSON."""

from __future__ import annotations

import msgspec

from bioscara.api.messages import BodyList, WorldSample
from bioscara.api.values import body_frame, body_transform, placed, shown_boxes
from bioscara.physics.bodies import COLOURS, BodyPose
from bioscara.recording.writing.rare_messages import transforms_message
from bioscara.rosbag.cdr import CdrMessage, put_stamp
from bioscara.rosbag.texts import text_message
from bioscara.rosbag.topics import Topic

_MOVED = 1e-5
"""Change of a coordinate [m], of a part of a quaternion, or of the width [m] that is written."""
_CUBE, _ADD, _DELETE_ALL = 1, 0, 3
"""Numbers of visualization_msgs/Marker."""

Messages = list[tuple[Topic, bytes]]

_encode = msgspec.json.Encoder().encode


class WorldMessages:
    """Encodes the samples of a world: the changes since the one before.

    Attributes:
        width: True width between the jaws in the last sample [m]; None before the first.
    """

    def __init__(self) -> None:
        self.width: float | None = None
        self._list: BodyList | None = None
        self._last: WorldSample | None = None
        self._poses: dict[str, BodyPose] = {}

    def begin(self, bodies: BodyList, stamp: int) -> Messages:
        """Return the messages of another list of bodies; samples of another one are passed over.

        Args:
            bodies: The list.
            stamp: Its time [ns].
        """
        self._list, self._last = bodies, None
        self._poses = {pose.name: pose for pose in bodies.poses}
        return [
            (Topic.BODY_LIST, text_message(_encode(bodies).decode())),
            (Topic.BODIES, markers_message(bodies, stamp)),
            *self.standing(stamp),
        ]

    def standing(self, stamp: int) -> Messages:
        """Return where all bodies are, for the begin of a file.

        Args:
            stamp: Its time [ns].
        """
        if self._list is None:
            return []
        messages = [(Topic.TF, self._transforms(list(self._poses.values()), stamp))]
        if self._last is not None:
            whole = msgspec.structs.replace(self._last, poses=tuple(self._poses.values()))
            messages.append((Topic.WORLD, text_message(_encode(whole).decode())))
        return messages

    def encode(self, sample: WorldSample, stamp: int) -> Messages:
        """Return the messages of a sample; none if nothing has changed.

        Args:
            sample: The sample.
            stamp: Its time [ns].
        """
        self.width = sample.width
        if self._list is None or sample.version != self._list.version:
            return []
        moved = [pose for pose in placed(self._list, sample) if _differs(pose, self._poses)]
        last = self._last
        if (
            not moved
            and last is not None
            and last.held == sample.held
            and abs(last.width - sample.width) <= _MOVED
        ):
            return []
        self._last = sample
        self._poses.update({pose.name: pose for pose in moved})
        changed = msgspec.structs.replace(sample, poses=tuple(moved))
        messages = [(Topic.WORLD, text_message(_encode(changed).decode()))]
        if moved:
            messages.append((Topic.TF, self._transforms(moved, stamp)))
        return messages

    def _transforms(self, poses: list[BodyPose], stamp: int) -> bytes:
        return transforms_message(map(body_transform, poses), stamp)


def markers_message(bodies: BodyList, stamp: int) -> bytes:
    """Return a visualization_msgs/MarkerArray: the boxes of each body in its own frame.

    Args:
        bodies: The bodies; the jaws are left out.
        stamp: Their time [ns].
    """
    boxes = shown_boxes(bodies.bodies)
    message = CdrMessage()
    message.uint32(1 + len(boxes))
    _marker(message, "", stamp, "", 0, _DELETE_ALL, (0.0,) * 3, (0.0,) * 3, (0.0,) * 4)
    for shape, number, (x, y, z, a, b, c) in boxes:
        _marker(
            message, body_frame(shape.name), stamp, shape.name, number, _ADD, (x, y, z),
            (2.0 * a, 2.0 * b, 2.0 * c), COLOURS[shape.kind],
        )  # fmt: skip
    return bytes(message.data)


def _marker(
    message: CdrMessage,
    frame: str,
    stamp: int,
    namespace: str,
    number: int,
    action: int,
    place: tuple[float, ...],
    size: tuple[float, ...],
    colour: tuple[float, ...],
) -> None:
    """Add a visualization_msgs/Marker that stays with its frame."""
    put_stamp(message.data, message.header(frame), stamp)
    message.string(namespace)
    for value in (number, _CUBE, action):
        message.uint32(value)
    message.doubles((*place, 0.0, 0.0, 0.0, 1.0, *size))
    message.floats(colour)
    # Its lifetime, none; whether it stays with its frame.
    message.stamp(0)
    message.byte(1)
    # Points and their colours; a texture: name, header, format, bytes and coordinates; a text; a
    # mesh: name, file and its bytes; whether that has materials.
    message.uint32(0)
    message.uint32(0)
    message.string("")
    message.header("")
    message.string("")
    message.uint32(0)
    message.uint32(0)
    for _ in range(3):
        message.string("")
    message.uint32(0)
    message.byte(0)


def _differs(pose: BodyPose, known: dict[str, BodyPose]) -> bool:
    former = known[pose.name]
    return any(abs(a - b) > _MOVED for a, b in zip(pose[1:], former[1:], strict=True))
