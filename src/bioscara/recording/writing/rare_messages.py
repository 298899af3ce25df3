"""Messages that come rarely: events, trajectories, fixed transforms and images."""

from __future__ import annotations

from collections.abc import Iterable

from bioscara.api.messages import Event, ImageFile, TrajectoryValue
from bioscara.hardware.link_frames import Transform
from bioscara.rosbag.cdr import CdrMessage, put_stamp
from bioscara.rosbag.joint_states import rounded
from bioscara.rosbag.texts import LogLevel, log_message

_LEVELS = {
    "fault": LogLevel.ERROR,
    "warning": LogLevel.WARNING,
    "gap": LogLevel.ERROR,
    "stop": LogLevel.WARNING,
}
"""Levels of events in the log; others are information."""
_SECOND = 1e9


def event_message(event: Event, arm: str, stamp: int) -> bytes:
    """Return an event as a rcl_interfaces/Log.

    Args:
        event: The event.
        arm: Name of the owner.
        stamp: Time of the event [ns].
    """
    level = _LEVELS.get(event.what, LogLevel.INFO)
    return log_message(
        stamp,
        level,
        arm,
        event.text,
        file=event.what,
        function=event.client,
        line=event.number,
    )


def trajectory_message(trajectory: TrajectoryValue, frame: str, stamp: int) -> bytes:
    """Return a trajectory_msgs/JointTrajectory.

    Args:
        trajectory: The trajectory.
        frame: Identifies it; joints have no frame.
        stamp: Time of its acceptance [ns].
    """
    message = CdrMessage()
    put_stamp(message.data, message.header(frame), stamp)
    message.strings(trajectory.joint_names)
    message.uint32(len(trajectory.times))
    for index, time in enumerate(trajectory.times):
        for rows in (trajectory.positions, trajectory.velocities, trajectory.accelerations, None):
            message.double_sequence(() if rows is None else rounded(rows[index]))
        message.stamp(round(time * _SECOND))
    return bytes(message.data)


def image_message(image: ImageFile, stamp: int) -> bytes:
    """Return an image as a sensor_msgs/CompressedImage.

    Args:
        image: The image; its frame is the name of the camera.
        stamp: Its time [ns].
    """
    message = CdrMessage()
    put_stamp(message.data, message.header(image.camera), stamp)
    message.string("png")
    message.uint32(len(image.data))
    message.data += image.data
    return bytes(message.data)


def transforms_message(transforms: Iterable[Transform], stamp: int) -> bytes:
    """Return a tf2_msgs/TFMessage.

    Args:
        transforms: The poses of links in their parents.
        stamp: Their time [ns].
    """
    given = list(transforms)
    message = CdrMessage()
    message.uint32(len(given))
    for parent, child, translation, rotation in given:
        put_stamp(message.data, message.header(parent), stamp)
        message.string(child)
        message.doubles((*translation, *rotation))
    return bytes(message.data)
