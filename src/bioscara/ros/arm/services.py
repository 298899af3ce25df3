"""Services that ros2_control does not have: plans, named poses, STOP, pauses and faults."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bioscara_interfaces import msg, srv
from std_srvs.srv import Trigger

from bioscara.errors import BioscaraError, InvalidArgumentError
from bioscara.kinematics import Joints, Pose
from bioscara.robot.planner import Plan
from bioscara.robot.workspace.poses import NamedPose
from bioscara.ros import messages
from bioscara.ros.bridge import Bridge

FOLDER = "bioscara"
"""Namespace of the services, below that of the node."""


class ArmServices:
    """Offers the services."""

    def __init__(self, bridge: Bridge) -> None:
        self._bridge = bridge
        offered: dict[str, tuple[Any, Callable[[Any, Any], object]]] = {
            "plan_to_joints": (srv.PlanToJoints, self._plan_to_joints),
            "plan_to_named": (srv.PlanToNamed, self._plan_to_named),
            "plan_to_pose": (srv.PlanToPose, self._plan_to_pose),
            "list_poses": (srv.ListPoses, self._list_poses),
            "save_pose": (srv.SavePose, self._save_pose),
            "delete_pose": (srv.DeletePose, self._delete_pose),
            "stop": (srv.Stop, lambda *_: bridge.owner.robot.stop()),
            "pause": (Trigger, lambda *_: bridge.owner.robot.pause()),
            "resume": (Trigger, lambda *_: bridge.owner.command(lambda robot: robot.resume())),
            "list_faults": (srv.ListFaults, self._list_faults),
            "acknowledge_faults": (
                srv.AcknowledgeFaults,
                lambda *_: bridge.owner.command(lambda robot: robot.acknowledge()),
            ),
            "recover": (
                srv.Recover,
                lambda *_: bridge.owner.command(lambda robot: robot.recover()),
            ),
        }
        for name, (kind, call) in offered.items():
            bridge.node.create_service(
                kind, f"{FOLDER}/{name}", self._callback(name, call), callback_group=bridge.parallel
            )

    def _callback(self, name: str, call: Callable[[Any, Any], object]) -> Callable[[Any, Any], Any]:
        """Return a callback that answers errors with their numbers and sentences."""

        def callback(request: Any, response: Any) -> Any:
            try:
                call(request, response)
            except BioscaraError as error:
                self._bridge.node.get_logger().error(f"{name}: {error}")
                if hasattr(response, "success"):
                    response.success, response.message = False, str(error)
                # Those of std_srvs have no number.
                if hasattr(response, "code"):
                    response.code = error.code
            else:
                if hasattr(response, "success"):
                    response.success = True
            return response

        return callback

    def _plan_to_joints(self, request: Any, response: Any) -> None:
        plan = self._bridge.owner.robot.plan.move_joints(
            tuple(request.positions), **scalings(request)
        )
        self._answer(plan, response)

    def _plan_to_named(self, request: Any, response: Any) -> None:
        plan = self._bridge.owner.robot.plan.move_named(request.name, **scalings(request))
        self._answer(plan, response)

    def _plan_to_pose(self, request: Any, response: Any) -> None:
        planner = self._bridge.owner.robot.plan
        method = planner.move_linear if request.linear else planner.move_to
        self._answer(method(pose_of(request.pose), **scalings(request)), response)

    def _answer(self, plan: Plan, response: Any) -> None:
        description = self._bridge.description
        response.trajectory = messages.planned_trajectory(plan.trajectory, description)
        response.notes = list(plan.notes)

    def _list_poses(self, _: Any, response: Any) -> None:
        table = self._bridge.owner.robot.table
        response.poses = [
            msg.NamedPose(
                name=pose.name,
                joints=list(pose.joints or ()),
                pose=[]
                if (at := pose.pose_tool_in_base) is None
                else [msg.ToolPose(**at._asdict())],
                tool=pose.tool,
            )
            for pose in table.all_poses()
        ]

    def _save_pose(self, request: Any, response: Any) -> None:  # noqa: ARG002
        given = request.pose

        def save(robot: Any) -> None:
            if given.joints and len(given.joints) != len(Joints._fields):
                raise InvalidArgumentError(
                    f"pose {given.name}: {len(given.joints)} joints; give {len(Joints._fields)} or "
                    "none"
                )
            joints = Joints(*given.joints) if given.joints else None
            place = pose_of(given.pose[0]) if given.pose else None
            tool = given.tool or robot.tool.name
            if joints is None and place is None:
                joints, place = Joints(*robot.state.positions), robot.pose
            pose = NamedPose(given.name, joints, place, tool)
            robot.table = robot.table.with_pose(pose, overwrite=request.overwrite)

        self._bridge.owner.command(save)

    def _delete_pose(self, request: Any, response: Any) -> None:  # noqa: ARG002
        def delete(robot: Any) -> None:
            robot.table = robot.table.without_pose(request.name)

        self._bridge.owner.command(delete)

    def _list_faults(self, _: Any, response: Any) -> None:
        found = self._bridge.owner.robot.fault_list()
        response.state, response.warnings = found.state, list(found.warnings)
        response.faults = [
            msg.Fault(
                fault=fault.fault,
                source=fault.source,
                text=fault.text,
                stamp=messages.stamp(self._bridge.time.ros(fault.time)),
                evidence=fault.evidence or "",
            )
            for fault in found.faults
        ]


def pose_of(message: Any) -> Pose:
    """Return the pose of a message."""
    return Pose(message.x, message.y, message.z, message.yaw)


def scalings(request: Any) -> dict[str, Any]:
    """Return the shares of the limits of a request or goal, as arguments of a motion."""
    return {
        "velocity_scaling": request.velocity_scaling,
        "acceleration_scaling": request.acceleration_scaling,
    }
