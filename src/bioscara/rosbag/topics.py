"""The topics of a recording: names, types and definitions of their messages."""

from __future__ import annotations

from enum import StrEnum
from typing import Self

_HEADER = """\
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""
_POINT_AND_QUATERNION = """\
MSG: geometry_msgs/{}
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
"""
_BETWEEN = "=" * 80 + "\n"

_DEFINITIONS = {
    "sensor_msgs/msg/JointState": (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
        "float64[] effort\n",
        _HEADER,
    ),
    "control_msgs/msg/DynamicJointState": (
        "std_msgs/Header header\nstring[] joint_names\n"
        "control_msgs/InterfaceValue[] interface_values\n",
        _HEADER,
        "MSG: control_msgs/InterfaceValue\nstring[] interface_names\nfloat64[] values\n",
    ),
    "geometry_msgs/msg/PoseStamped": (
        "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
        _HEADER,
        "MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\n"
        "geometry_msgs/Quaternion orientation\n",
        _POINT_AND_QUATERNION.format("Point"),
    ),
    "tf2_msgs/msg/TFMessage": (
        "geometry_msgs/TransformStamped[] transforms\n",
        "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
        "geometry_msgs/Transform transform\n",
        _HEADER,
        "MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\n"
        "geometry_msgs/Quaternion rotation\n",
        _POINT_AND_QUATERNION.format("Vector3"),
    ),
    "trajectory_msgs/msg/JointTrajectory": (
        "std_msgs/Header header\nstring[] joint_names\n"
        "trajectory_msgs/JointTrajectoryPoint[] points\n",
        _HEADER,
        "MSG: trajectory_msgs/JointTrajectoryPoint\nfloat64[] positions\nfloat64[] velocities\n"
        "float64[] accelerations\nfloat64[] effort\n"
        "builtin_interfaces/Duration time_from_start\n",
    ),
    "rcl_interfaces/msg/Log": (
        "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\n"
        "string function\nuint32 line\n",
    ),
    "std_msgs/msg/String": ("string data\n",),
    "sensor_msgs/msg/CompressedImage": (
        "std_msgs/Header header\nstring format\nuint8[] data\n",
        _HEADER,
    ),
    "visualization_msgs/msg/MarkerArray": (
        "visualization_msgs/Marker[] markers\n",
        "MSG: visualization_msgs/Marker\nstd_msgs/Header header\nstring ns\nint32 id\n"
        "int32 type\nint32 action\ngeometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\n"
        "std_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\nbool frame_locked\n"
        "geometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring texture_resource\n"
        "sensor_msgs/CompressedImage texture\n"
        "visualization_msgs/UVCoordinate[] uv_coordinates\nstring text\nstring mesh_resource\n"
        "visualization_msgs/MeshFile mesh_file\nbool mesh_use_embedded_materials\n",
        _HEADER,
        "MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\n"
        "geometry_msgs/Quaternion orientation\n",
        _POINT_AND_QUATERNION.format("Point"),
        "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n",
        "MSG: std_msgs/ColorRGBA\nfloat32 r\nfloat32 g\nfloat32 b\nfloat32 a\n",
        "MSG: sensor_msgs/CompressedImage\nstd_msgs/Header header\nstring format\nuint8[] data\n",
        "MSG: visualization_msgs/UVCoordinate\nfloat32 u\nfloat32 v\n",
        "MSG: visualization_msgs/MeshFile\nstring filename\nuint8[] data\n",
    ),
}


class Topic(StrEnum):
    """A topic, by its name.

    Attributes:
        type_name: Type of its messages.
        latched: Whether its last message holds until the next one: each file begins with it.
    """

    JOINT_STATES = ("/joint_states", "sensor_msgs/msg/JointState", False)
    DYNAMIC_JOINT_STATES = (
        "/dynamic_joint_states",
        "control_msgs/msg/DynamicJointState",
        False,
    )
    JOINT_COMMANDS = ("/joint_commands", "sensor_msgs/msg/JointState", False)
    TOOL_POSE = ("/tool_pose", "geometry_msgs/msg/PoseStamped", False)
    TF = ("/tf", "tf2_msgs/msg/TFMessage", False)
    TF_STATIC = ("/tf_static", "tf2_msgs/msg/TFMessage", True)
    STATUS = ("/status", "std_msgs/msg/String", True)
    EVENTS = ("/events", "std_msgs/msg/String", False)
    LOG = ("/rosout", "rcl_interfaces/msg/Log", False)
    FAULTS = ("/faults", "std_msgs/msg/String", True)
    STATISTICS = ("/statistics", "std_msgs/msg/String", False)
    TRAJECTORIES = ("/planned_trajectory", "trajectory_msgs/msg/JointTrajectory", False)
    WORKSPACE = ("/workspace", "std_msgs/msg/String", True)
    BODY_LIST = ("/body_list", "std_msgs/msg/String", True)
    BODIES = ("/bodies", "visualization_msgs/msg/MarkerArray", True)
    WORLD = ("/world", "std_msgs/msg/String", False)
    IMAGE = ("/camera/image/compressed", "sensor_msgs/msg/CompressedImage", False)
    PARAMETERS = ("/parameters", "std_msgs/msg/String", True)
    ROBOT_DESCRIPTION = ("/robot_description", "std_msgs/msg/String", True)

    type_name: str
    latched: bool

    def __new__(cls, name: str, type_name: str, latched: bool) -> Self:
        """Return a topic with its attributes."""
        topic = str.__new__(cls, name)
        topic._value_ = name
        topic.type_name, topic.latched = type_name, latched
        return topic


def definition(type_name: str) -> str:
    """Return the definition of a type with those that it is made of, as ROS 2 concatenates them."""
    return _BETWEEN.join(_DEFINITIONS[type_name])


def quality_of_service(*, latched: bool) -> str:
    """Return how a topic was offered, in the words of rosbag2, which offers it likewise again."""
    return (
        f"- history: keep_last\n  depth: {1 if latched else 10}\n  reliability: reliable\n"
        f"  durability: {'transient_local' if latched else 'volatile'}\n"
        "  deadline:\n    sec: 9223372036\n    nsec: 854775807\n"
        "  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n"
        "  liveliness: automatic\n"
        "  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n"
        "  avoid_ros_namespace_conventions: false\n"
    )
