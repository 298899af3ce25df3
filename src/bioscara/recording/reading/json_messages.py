"""Messages of an owner that were recorded as JSON."""

from __future__ import annotations

import math
from typing import Any, TypeVar

import msgspec

from bioscara.errors import RecordingError
from bioscara.rosbag.cdr import CdrReader

M = TypeVar("M")

_NUMBERS = frozenset(("progress", "duration", "position", "velocity", "speed_override"))
_TRIPLES = frozenset(("late", "read", "update", "write", "widths"))
"""Names of fields that are numbers, or some of them: JSON has null for an unknown one."""


def message_of(data: bytes, kind: type[M]) -> M:
    """Return a message that was recorded as std_msgs/String.

    Raises:
        RecordingError: It is not of that type, as of another version of the software.
    """
    try:
        return msgspec.convert(_with_unknown(msgspec.json.decode(CdrReader(data).string())), kind)
    except msgspec.MsgspecError as error:
        raise RecordingError(
            f"a recorded {kind.__name__} cannot be read: {error}; use the version that recorded it"
        ) from error


def _with_unknown(value: Any) -> Any:
    """Return the value with NaN where a number is unknown."""
    if isinstance(value, list):
        return [_with_unknown(each) for each in value]
    if not isinstance(value, dict):
        return value
    return {name: _unknown_or(name, each) for name, each in value.items()}


def _unknown_or(name: str, value: Any) -> Any:
    if value is None and name in _NUMBERS:
        return math.nan
    if name in _TRIPLES and isinstance(value, list):
        return [math.nan if each is None else each for each in value]
    return _with_unknown(value)
