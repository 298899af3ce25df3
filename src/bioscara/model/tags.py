"""Names in the ``<ros2_control>`` tags, as written by ``description/control.xacro``."""

from __future__ import annotations

ARM_COMPONENT, GRIPPER_COMPONENT = "bioscara_arm", "bioscara_gripper_128"
"""Names of the hardware components."""

JOINT_TAGS = {
    "address": "i2c_address",
    "reduction": "reduction",
    "lower": "min",
    "upper": "max",
    "stall_threshold": "stall_threshold",
    "hold_current_percent": "hold_current",
    "drive_current_percent": "drive_current",
    "max_acceleration": "max_acceleration",
    "max_velocity": "max_velocity",
}
"""Names of a joint's ``<param>`` tags, by the field that they fill."""
HOMING_TAGS = {
    "velocity": "homing_speed",
    "threshold": "homing_threshold",
    "current_percent": "homing_current",
    "acceleration": "homing_acceleration",
}
"""The same for its homing."""
GRIPPER_TAGS = {
    "deg_per_m": "reduction",
    "zero_width": "offset",
    "lower": "min",
    "upper": "max",
    "initial": "init_pos",
}
"""The same for the gripper."""
