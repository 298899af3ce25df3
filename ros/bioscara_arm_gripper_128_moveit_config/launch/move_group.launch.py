"""Start MoveIt's move_group for the arm with its gripper.

The description on the topic robot_description is that of the node that drives the arm; move_group
publishes only the semantic one.
"""

from __future__ import annotations

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare
from moveit_configs_utils import MoveItConfigsBuilder

PACKAGE = "bioscara_arm_gripper_128_moveit_config"
TASKS = "moveit_task_constructor_capabilities"


def generate_launch_description() -> LaunchDescription:
    """Return the argument and the node."""
    config = (
        MoveItConfigsBuilder("scene", package_name=PACKAGE)
        .robot_description(
            mappings={
                "gripper_description_package": "bioscara_gripper_descriptions",
                "table": LaunchConfiguration("table"),
            }
        )
        .planning_pipelines(
            default_planning_pipeline="ompl", pipelines=["ompl", "pilz_industrial_motion_planner"]
        )
        .planning_scene_monitor(
            publish_robot_description=False, publish_robot_description_semantic=True
        )
        .to_moveit_configs()
    )
    parameters = [config.to_dict()]
    if installed(TASKS):
        parameters.append({"capabilities": "move_group/ExecuteTaskSolutionCapability"})
    files = PathJoinSubstitution(
        [FindPackageShare("bioscara_arm_description"), "launch", "temporary_files.py"]
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "table", default_value="true", description="Keep the arm clear of the table."
            ),
            DeclareLaunchArgument(
                "namespace", default_value="", description="Namespace of the node and of the arm's."
            ),
            IncludeLaunchDescription(PythonLaunchDescriptionSource(files)),
            Node(
                package="moveit_ros_move_group",
                executable="move_group",
                namespace=LaunchConfiguration("namespace"),
                parameters=parameters,
                output="screen",
            ),
        ]
    )


def installed(package: str) -> bool:
    """Return whether there is such a package: the task constructor is optional."""
    try:
        get_package_share_directory(package)
    except PackageNotFoundError:
        return False
    return True
