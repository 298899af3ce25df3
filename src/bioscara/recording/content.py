"""Names of the contents of a recording, for the writer and the reader."""

from __future__ import annotations

import msgspec

METADATA = "bioscara"
"""Name of the metadata of each file."""
DESCRIPTION, PARAMETERS, OVERLAY = "robot_description.urdf", "parameters.json", "overlay.yaml"
"""Names of the attachments."""
GRIPPER = "gripper"
"""Name of the gripper, among those of the joints."""


class ArmStatus(msgspec.Struct, frozen=True):
    """The part of a sample that changes rarely; written when it does.

    Attributes are those of :class:`bioscara.api.messages.StateSample`.
    """

    enabled: bool
    fault: str
    paused: bool
    speed_override: float
    moving: tuple[str, ...]
    stale: bool
