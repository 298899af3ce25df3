"""Messages that come rarely: texts, log entries, trajectories and fixed transforms."""

from __future__ import annotations

from collections.abc import Iterable

from bioscara.api.messages import Event, TrajectoryValue
from bioscara.recording.cdr import CdrMessage, put_stamp
from bioscara.recording.frames import Transform
from bioscara.recording.sample_messages import rounded

_INFO, _WARNING, _ERROR = 20, 30, 40
_LEVELS = {"fault": _ERROR, "warning": _WARNING, "gap": _ERROR, "stop": _WARNING}
"""Levels of events in the log, as rcl_interfaces numbers them; others are information."""
_SECOND = 1e9


def text_message(text: str) -> bytes:
    """Return a std_msgs/String."""
    message = CdrMessage()
    message.string(text)
    return bytes(message.data)


def log_message(event: Event, arm: str, stamp: int) -> bytes:
    """Return an event as a rcl_interfaces/Log.

    Args:
        event: The event.
        arm: Name of the owner.
        stamp: Time of the event [ns].
    """
    message = CdrMessage()
    message.stamp(stamp)
    message.byte(_LEVELS.get(event.what, _INFO))
    message.string(arm)
    message.string(event.text)
    message.string(event.what)
    message.string(event.client)
    message.uint32(event.number % 2**32)
    return bytes(message.data)


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


def transforms_message(transforms: Iterable[tuple[str, str, Transform]], stamp: int) -> bytes:
    """Return a tf2_msgs/TFMessage.

    Args:
        transforms: Of each its parent, its child, and the child in the parent.
        stamp: Their time [ns].
    """
    given = list(transforms)
    message = CdrMessage()
    message.uint32(len(given))
    for parent, child, transform in given:
        put_stamp(message.data, message.header(parent), stamp)
        message.string(child)
        message.doubles(transform)
    return bytes(message.data)
