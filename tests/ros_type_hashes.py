"""Type hashes of ROS 2 (RIHS01) from definition files, without ROS.

Two programs understand each other only if the hashes of the types they use are equal: a hash covers
names, types and order of all fields, and of the types that they are made of.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from mcap_ros2._vendor.rosidl_adapter import parser

DEFINITIONS = Path(__file__).parents[1] / "interfaces" / "definitions"

# The types of other packages that ours are made of: facts of ROS 2, all on PyPI.
OTHERS = {
    "builtin_interfaces/msg/Duration": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec",
    "diagnostic_msgs/msg/KeyValue": "string key\nstring value",
    "geometry_msgs/msg/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/msg/Pose": "Point position\nQuaternion orientation",
    "geometry_msgs/msg/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/msg/Transform": "Vector3 translation\nQuaternion rotation",
    "geometry_msgs/msg/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\nTransform transform"
    ),
    "geometry_msgs/msg/Twist": "Vector3 linear\nVector3 angular",
    "geometry_msgs/msg/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "lifecycle_msgs/msg/State": "uint8 id\nstring label",
    "sensor_msgs/msg/JointState": (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\n"
        "float64[] velocity\nfloat64[] effort"
    ),
    "service_msgs/msg/ServiceEventInfo": (
        "uint8 event_type\nbuiltin_interfaces/Time stamp\nchar[16] client_gid\n"
        "int64 sequence_number"
    ),
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "trajectory_msgs/msg/JointTrajectory": (
        "std_msgs/Header header\nstring[] joint_names\nJointTrajectoryPoint[] points"
    ),
    "trajectory_msgs/msg/JointTrajectoryPoint": (
        "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n"
        "builtin_interfaces/Duration time_from_start"
    ),
    "trajectory_msgs/msg/MultiDOFJointTrajectory": (
        "std_msgs/Header header\nstring[] joint_names\nMultiDOFJointTrajectoryPoint[] points"
    ),
    "trajectory_msgs/msg/MultiDOFJointTrajectoryPoint": (
        "geometry_msgs/Transform[] transforms\ngeometry_msgs/Twist[] velocities\n"
        "geometry_msgs/Twist[] accelerations\nbuiltin_interfaces/Duration time_from_start"
    ),
}

# Numbers of type_description_interfaces/msg/FieldType.
NESTED = 1
NUMBERS = {
    "int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8,
    "uint64": 9, "float32": 10, "float64": 11, "char": 3, "bool": 15, "byte": 16, "string": 17,
    "wstring": 18,
}  # fmt: skip
ARRAY, BOUNDED, UNBOUNDED = 48, 96, 144

Field = dict[str, Any]


def _message(package: str, name: str, text: str) -> parser.MessageSpecification:
    return parser.parse_message_string(package, name, text)


def parts(name: str) -> dict[str, parser.MessageSpecification]:
    """Parse one of our definitions.

    Args:
        name: As ``control_msgs/action/FollowJointTrajectory``.

    Returns:
        The messages that it consists of, by name: one, or ``NAME_Request`` and ``NAME_Response``,
        or ``NAME_Goal``, ``NAME_Result`` and ``NAME_Feedback``.
    """
    package, kind, short = name.split("/")
    path = DEFINITIONS / package / kind / f"{short}.{kind}"
    text = OTHERS[name] if name in OTHERS else path.read_text(encoding="utf-8")
    if kind == "msg":
        return {name: _message(package, short, text)}
    if kind == "srv":
        service = parser.parse_service_string(package, short, text)
        return {f"{name}_Request": service.request, f"{name}_Response": service.response}
    action = parser.parse_action_string(package, short, text)
    return {
        f"{name}_Goal": action.goal,
        f"{name}_Result": action.result,
        f"{name}_Feedback": action.feedback,
    }


def _field(name: str, number: int, nested: str = "", capacity: int = 0, length: int = 0) -> Field:
    type_ = {
        "type_id": number,
        "capacity": capacity,
        "string_capacity": length,
        "nested_type_name": nested,
    }
    return {"name": name, "type": type_}


def _fields(message: parser.MessageSpecification) -> list[Field]:
    fields = []
    for field in message.fields:
        type_ = field.type
        nested = "" if type_.is_primitive_type() else f"{type_.pkg_name}/msg/{type_.type}"
        number = NESTED if nested else NUMBERS[type_.type]
        if type_.is_array:
            fixed = type_.array_size and not type_.is_upper_bound
            number += ARRAY if fixed else BOUNDED if type_.is_upper_bound else UNBOUNDED
        size, length = type_.array_size or 0, type_.string_upper_bound or 0
        fields.append(_field(field.name, number, nested, size, length))
    return fields or [_field("structure_needs_at_least_one_member", NUMBERS["uint8"])]


def _described(name: str) -> list[Field]:
    """Return the fields of a type, of a part of one, or of a service."""
    package, kind, short = name.split("/")
    own = short.split("_")[0]
    whole = f"{package}/{kind}/{own}"
    if kind == "srv" and short == own:
        names = ("request", "response", "event")
        return [_field(f"{n}_message", NESTED, f"{name}_{n.title()}") for n in names]
    if kind == "srv" and short.endswith("_Event"):
        return [
            _field("info", NESTED, "service_msgs/msg/ServiceEventInfo"),
            _field("request", NESTED + BOUNDED, f"{whole}_Request", 1),
            _field("response", NESTED + BOUNDED, f"{whole}_Response", 1),
        ]
    return _fields(parts(whole)[name])


def type_hash(name: str) -> str:
    """Compute the hash of a message, of a service, or of a part of an action.

    Args:
        name: As ``control_msgs/msg/DynamicJointState``.

    Returns:
        The hash [hexadecimal].
    """
    found: dict[str, list[Field]] = {}
    to_do = [name]
    while to_do:
        current = to_do.pop()
        if current not in found:
            found[current] = _described(current)
            to_do += [n for f in found[current] if (n := f["type"]["nested_type_name"])]
    described = [
        {"type_name": n, "fields": found[n]} for n in [name, *sorted(found.keys() - {name})]
    ]
    whole = {"type_description": described[0], "referenced_type_descriptions": described[1:]}
    return hashlib.sha256(json.dumps(whole).encode()).hexdigest()
