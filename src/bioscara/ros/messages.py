"""Messages of ROS from values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from builtin_interfaces.msg import Time
from control_msgs.action import FollowJointTrajectory, ParallelGripperCommand
from control_msgs.msg import DynamicJointState, InterfaceValue, JointTrajectoryControllerState
from controller_manager_msgs.msg import (
    ControllerManagerActivity,
    ControllerState,
    HardwareComponentState,
    HardwareInterface,
    NamedLifecycleState,
)
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from lifecycle_msgs.msg import State
from rclpy.duration import Duration
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA, Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import Marker, MarkerArray

from bioscara.api import messages as m
from bioscara.api.values import body_frame, shown_boxes
from bioscara.control.controllers.joint_trajectory import goal_messages
from bioscara.hardware.link_frames import Transform
from bioscara.physics.bodies import COLOURS
from bioscara.planning import Sample, Trajectory
from bioscara.ros.arm.description import RobotDescription

NUMBERS = {
    "unknown": State.PRIMARY_STATE_UNKNOWN,
    "unconfigured": State.PRIMARY_STATE_UNCONFIGURED,
    "inactive": State.PRIMARY_STATE_INACTIVE,
    "active": State.PRIMARY_STATE_ACTIVE,
    "finalized": State.PRIMARY_STATE_FINALIZED,
}
"""Numbers of the lifecycle states, by their labels."""


def stamp(time: float) -> Time:
    """Return a time [s]."""
    second, rest = divmod(round(time * 1e9), 10**9)
    return Time(sec=second, nanosec=rest)


def header(time: float, frame: str = "") -> Header:
    """Return a header with a time [s]."""
    return Header(stamp=stamp(time), frame_id=frame)


def lifecycle_state(label: str) -> State:
    """Return a lifecycle state with number and label."""
    return State(id=NUMBERS[label], label=label)


def controller_state(value: m.ControllerValue, description: RobotDescription) -> ControllerState:
    """Return a controller in the list of controllers."""

    def names(interfaces: Sequence[str]) -> list[str]:
        return [description.described(name) for name in interfaces]

    return ControllerState(
        name=value.name,
        state=value.state,
        type=value.type,
        update_rate=round(value.update_rate),
        claimed_interfaces=names(value.claimed),
        required_command_interfaces=names(value.commands),
        required_state_interfaces=names(value.states),
    )


def interfaces(
    values: Sequence[m.InterfaceValue], description: RobotDescription
) -> list[HardwareInterface]:
    """Return the interfaces whose joints are in the description."""
    return [
        HardwareInterface(
            name=description.described(value.name),
            data_type="double",
            is_available=value.available,
            is_claimed=value.claimed,
        )
        for value in values
        if description.has(value.name)
    ]


def component_state(
    value: m.ComponentValue, name: str, description: RobotDescription
) -> HardwareComponentState:
    """Return a hardware component in the list of components."""
    return HardwareComponentState(
        name=name,
        type=value.type,
        rw_rate=value.rate,
        plugin_name=value.plugin,
        state=lifecycle_state(value.state),
        command_interfaces=interfaces(value.commands, description),
        state_interfaces=interfaces(value.states, description),
    )


def activity(
    time: float, controllers: Mapping[str, str], components: Mapping[str, str]
) -> ControllerManagerActivity:
    """Return the states of all controllers and components, by their names."""

    def named(states: Mapping[str, str]) -> list[NamedLifecycleState]:
        return [
            NamedLifecycleState(name=name, state=lifecycle_state(label))
            for name, label in states.items()
        ]

    return ControllerManagerActivity(
        header=header(time), controllers=named(controllers), hardware_components=named(components)
    )


def joint_state(
    time: float, frame: str, names: Sequence[str], values: Sequence[Sequence[float]]
) -> JointState:
    """Return joint states.

    Args:
        time: [s].
        frame: The frame.
        names: The joints.
        values: Positions, velocities and efforts.
    """
    position, velocity, effort = map(list, values)
    return JointState(
        header=header(time, frame),
        name=list(names),
        position=position,
        velocity=velocity,
        effort=effort,
    )


def dynamic_joint_state(
    time: float, frame: str, joints: Mapping[str, Mapping[str, float]]
) -> DynamicJointState:
    """Return the values of all interfaces, by joint and kind."""
    return DynamicJointState(
        header=header(time, frame),
        joint_names=list(joints),
        interface_values=[
            InterfaceValue(interface_names=list(values), values=list(values.values()))
            for values in joints.values()
        ],
    )


def transform(time: float, value: Transform) -> TransformStamped:
    """Return the pose of a link in its parent."""
    (x, y, z), (a, b, c, d) = value.translation, value.rotation
    message = TransformStamped(header=header(time, value.parent), child_frame_id=value.child)
    message.transform.translation = Vector3(x=x, y=y, z=z)
    message.transform.rotation = Quaternion(x=a, y=b, z=c, w=d)
    return message


def markers(time: float, bodies: m.BodyList | None) -> MarkerArray:
    """Return the boxes of bodies in their frames, in place of those before; None for no bodies."""
    found = [Marker(header=header(time), action=Marker.DELETEALL)]
    for shape, number, box in shown_boxes(bodies.bodies if bodies else ()):
        marker = Marker(
            header=header(time, body_frame(shape.name)),
            ns=shape.name,
            id=number,
            type=Marker.CUBE,
            scale=Vector3(x=2.0 * box.half_x, y=2.0 * box.half_y, z=2.0 * box.half_z),
            color=ColorRGBA(**dict(zip("rgba", COLOURS[shape.kind], strict=True))),
            frame_locked=True,
        )
        place = marker.pose.position
        place.x, place.y, place.z = box.x, box.y, box.z
        found.append(marker)
    return MarkerArray(markers=found)


def point(sample: Sample, time: float = 0.0) -> JointTrajectoryPoint:
    """Return a state of joints as a point of a trajectory."""
    return JointTrajectoryPoint(
        positions=list(sample.positions),
        velocities=list(sample.velocities),
        accelerations=list(sample.accelerations),
        time_from_start=Duration(nanoseconds=round(time * 1e9)).to_msg(),
    )


def trajectory_state(
    time: float, value: m.TrajectoryStatus, description: RobotDescription
) -> JointTrajectoryControllerState:
    """Return the state of a trajectory controller."""
    output = JointTrajectoryPoint()
    for name, number in value.output.items():
        kind = "positions" if name.endswith("/position") else "velocities"
        getattr(output, kind).append(number)
    return JointTrajectoryControllerState(
        header=header(time),
        joint_names=[description.described(name) for name in value.joints],
        reference=point(value.reference, value.trajectory_time),
        feedback=point(value.feedback),
        error=point(value.error),
        output=output,
        speed_scaling_factor=value.scaling,
    )


def trajectory_feedback(
    time: float, value: m.TrajectoryStatus, description: RobotDescription
) -> FollowJointTrajectory.Feedback:
    """Return the progress of a goal."""
    return FollowJointTrajectory.Feedback(
        header=header(time),
        joint_names=[description.described(name) for name in value.joints],
        desired=point(value.reference, value.trajectory_time),
        actual=point(value.feedback),
        error=point(value.error),
        index=value.point,
    )


def trajectory_result(ended: m.EndedGoal) -> FollowJointTrajectory.Result:
    """Return how a goal of a trajectory controller ended."""
    return FollowJointTrajectory.Result(error_code=ended.error_code, error_string=ended.text)


def gripper_result(ended: m.EndedGoal, joint: str) -> ParallelGripperCommand.Result:
    """Return how a goal of a gripper controller ended."""
    result = ParallelGripperCommand.Result()
    if (jaws := ended.gripper) is not None:
        result.state = JointState(name=[joint], position=[jaws.position], velocity=[jaws.velocity])
        result.stalled, result.reached_goal = jaws.stalled, jaws.reached_goal
    return result


def planned_trajectory(trajectory: Trajectory, description: RobotDescription) -> JointTrajectory:
    """Return a planned trajectory."""
    points = goal_messages.JointTrajectory.of(trajectory).points
    return JointTrajectory(
        joint_names=[description.described(name) for name in trajectory.joint_names],
        points=[
            point(Sample(each.positions, each.velocities, each.accelerations), each.time)
            for each in points
        ],
    )
