"""Definitions of ROS 2 interfaces: those of others as upstream has them, ours as we need them."""

from __future__ import annotations

import pytest

from ros_type_hashes import DEFINITIONS, parts, type_hash

NAMES = sorted(
    f"{path.parent.parent.name}/{path.parent.name}/{path.stem}"
    for path in DEFINITIONS.glob("*/*/*.*")
)

# From the code that ROS 2 generated of upstream's definitions.
UPSTREAM = {
    "control_msgs/msg/DynamicJointState": (
        "18024c98a62697680f581108eeed40b28fb4542fa0ac5a8e36f56c62b6813d26"
    ),
    "control_msgs/msg/HardwareStatus": (
        "d4d081efebdea6d8863855733ea95c58338ac4ffdb501a9524da4cbbad9927a2"
    ),
    "control_msgs/msg/JointJog": (
        "ba249455a20f70168a1acb7bf43b776b72ff1f7eb5fc4cfea443f749e963c6e7"
    ),
    "control_msgs/msg/JointTolerance": (
        "c254f9cece0f3b733017b6990fd46d1326e25242d6b8844398c97d9a88e7d648"
    ),
    "control_msgs/msg/SpeedScalingFactor": (
        "0c240f349f2b74e33e8741f83e0f196ddeb6585923663876ed3c1f51f0566037"
    ),
    "control_msgs/srv/QueryTrajectoryState": (
        "4a0935dffef18bc5b9e101c9d03d84e681ecd4cebd724b8f11fde008751a325a"
    ),
    "controller_manager_msgs/msg/ControllerManagerActivity": (
        "35b7de5d611b6780e89732de325f2f765eacdb8a7adfe5821a27af4a03a7c244"
    ),
    "controller_manager_msgs/srv/ListControllers": (
        "4f8e36bb1fa5afdeba45c2d56ae6a2097b1493a253f961dd6290c085033bd189"
    ),
    "controller_manager_msgs/srv/SetHardwareComponentState": (
        "940b15846ed3e1fb561ab45edf77a992b811fd59c574f45d5205a84a0deb2f65"
    ),
    "std_msgs/msg/Header": "f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01",
    "tf2_msgs/msg/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
}

# Types whose hash is not known from elsewhere, or differs between distributions: kilted's fields.
FIELDS = {
    "control_msgs/action/FollowJointTrajectory": {
        "Goal": (
            "trajectory multi_dof_trajectory path_tolerance component_path_tolerance "
            "goal_tolerance component_goal_tolerance goal_time_tolerance"
        ),
        "Result": "error_code error_string",
        "Feedback": (
            "header joint_names desired actual error index multi_dof_joint_names "
            "multi_dof_desired multi_dof_actual multi_dof_error multi_dof_index"
        ),
    },
    "control_msgs/action/GripperCommand": {
        "Goal": "command",
        "Result": "position effort stalled reached_goal",
        "Feedback": "position effort stalled reached_goal",
    },
    "control_msgs/action/ParallelGripperCommand": {
        "Goal": "command",
        "Result": "state stalled reached_goal",
        "Feedback": "state",
    },
    "control_msgs/msg/JointTrajectoryControllerState": {
        "": (
            "header joint_names reference feedback error output multi_dof_joint_names "
            "multi_dof_reference multi_dof_feedback multi_dof_error multi_dof_output "
            "speed_scaling_factor"
        )
    },
    "controller_manager_msgs/msg/HardwareComponentState": {
        "": "name type is_async rw_rate plugin_name state command_interfaces state_interfaces"
    },
    "controller_manager_msgs/msg/HardwareInterface": {"": "name data_type is_available is_claimed"},
    "controller_manager_msgs/srv/SwitchController": {
        "Request": "activate_controllers deactivate_controllers strictness activate_asap timeout",
        "Response": "ok message",
    },
}

# Imports of each client.
CLIENTS = {
    "spawner, unspawner, ros2 control": [
        f"controller_manager_msgs/srv/{name}"
        for name in (
            "CleanupController", "ConfigureController", "ListControllerTypes", "ListControllers",
            "ListHardwareComponents", "ListHardwareInterfaces", "LoadController",
            "ReloadControllerLibraries", "SetHardwareComponentState", "SwitchController",
            "UnloadController",
        )
    ],
    "ros2 control view_hardware_status": ["control_msgs/msg/HardwareStatus"],
    "test trajectory publisher, MoveIt": [
        "control_msgs/action/FollowJointTrajectory",
        "control_msgs/action/GripperCommand",
        "control_msgs/action/ParallelGripperCommand",
    ],
    "RViz panel": [
        "control_msgs/msg/DynamicInterfaceGroupValues",
        "control_msgs/msg/DynamicJointState",
        "controller_manager_msgs/msg/ControllerManagerActivity",
    ],
    "joint trajectory controller": [
        "control_msgs/msg/JointTrajectoryControllerState",
        "control_msgs/msg/SpeedScalingFactor",
        "control_msgs/srv/QueryTrajectoryState",
    ],
    "MoveIt Servo": ["control_msgs/msg/JointJog"],
    "RViz": ["tf2_msgs/msg/TFMessage"],
    "PlotJuggler": [
        "pal_statistics_msgs/msg/Statistics",
        "pal_statistics_msgs/msg/StatisticsNames",
        "pal_statistics_msgs/msg/StatisticsValues",
    ],
}  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_a_definition_has_only_types_that_exist(name: str) -> None:
    for part in parts(name):
        assert len(type_hash(part)) == 64


@pytest.mark.parametrize("name", UPSTREAM)
def test_the_hash_is_that_of_upstream(name: str) -> None:
    assert type_hash(name) == UPSTREAM[name]


@pytest.mark.parametrize("name", FIELDS)
def test_the_fields_are_those_of_kilted(name: str) -> None:
    found = {
        part.removeprefix(name).removeprefix("_"): " ".join(field.name for field in message.fields)
        for part, message in parts(name).items()
    }
    assert found == FIELDS[name]


@pytest.mark.parametrize("client", CLIENTS)
def test_a_client_has_what_it_imports(client: str) -> None:
    assert set(CLIENTS[client]) <= set(NAMES)


def test_constants_that_clients_use_have_their_numbers() -> None:
    def constants(name: str, part: str) -> dict[str, object]:
        return {c.name: c.value for c in parts(name)[f"{name}{part}"].constants}

    assert constants("controller_manager_msgs/srv/SwitchController", "_Request") == {
        "BEST_EFFORT": 1,
        "STRICT": 2,
        "AUTO": 3,
        "FORCE_AUTO": 4,
    }
    assert constants("control_msgs/action/FollowJointTrajectory", "_Result") == {
        "SUCCESSFUL": 0,
        "INVALID_GOAL": -1,
        "INVALID_JOINTS": -2,
        "OLD_HEADER_TIMESTAMP": -3,
        "PATH_TOLERANCE_VIOLATED": -4,
        "GOAL_TOLERANCE_VIOLATED": -5,
    }


OURS = [name for name in NAMES if name.startswith("bioscara_interfaces/")]


@pytest.mark.parametrize("name", OURS)
def test_ours_say_whether_it_was_done_and_why_not(name: str) -> None:
    lists = {"ListFaults", "ListPoses"}
    for part, message in parts(name).items():
        fields = {field.name: field for field in message.fields}
        if part.endswith(("_Response", "_Result")) and name.rsplit("/", 1)[-1] not in lists:
            assert {"success", "code", "message"} <= fields.keys()
        for scaling in fields.keys() & {"velocity_scaling", "acceleration_scaling"}:
            assert fields[scaling].default_value == 1.0


@pytest.mark.parametrize("name", OURS)
def test_ours_need_no_package_that_is_not_on_pypi(name: str) -> None:
    for message in parts(name).values():
        packages = {field.type.pkg_name for field in message.fields} - {None}
        assert packages <= {"bioscara_interfaces", "builtin_interfaces", "trajectory_msgs"}
