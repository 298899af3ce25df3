"""Messages of ROS 2 that are texts."""

from __future__ import annotations

from enum import IntEnum

from bioscara.rosbag.cdr import CdrMessage


class LogLevel(IntEnum):
    """Level of an entry of the log, as rcl_interfaces numbers it."""

    INFO = 20
    WARNING = 30
    ERROR = 40


def text_message(text: str) -> bytes:
    """Return a std_msgs/String."""
    message = CdrMessage()
    message.string(text)
    return bytes(message.data)


def log_message(
    stamp: int, level: LogLevel, name: str, text: str, *, file: str, function: str, line: int
) -> bytes:
    """Return a rcl_interfaces/Log.

    Args:
        stamp: Its time [ns].
        level: Its level.
        name: What it is about, such as an arm.
        text: A sentence.
        file: Place of its origin.
        function: Place in that.
        line: Number in that.
    """
    message = CdrMessage()
    message.stamp(stamp)
    message.byte(level)
    for each in (name, text, file, function):
        message.string(each)
    message.uint32(line % 2**32)
    return bytes(message.data)
