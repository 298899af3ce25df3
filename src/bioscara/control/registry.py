"""Every controller type by the name that ROS gives it."""

from __future__ import annotations

from bioscara.control.controller import AnyController
from bioscara.control.forward_command_controller import ForwardCommandController
from bioscara.control.gripper_action_controller import GripperActionController
from bioscara.control.hold_controller import HoldController
from bioscara.control.homing_controller import HomingController
from bioscara.control.jog_controller import JogController
from bioscara.control.joint_state_broadcaster import JointStateBroadcaster
from bioscara.control.joint_trajectory import JointTrajectoryController

TYPES: dict[str, type[AnyController]] = {
    controller.TYPE: controller
    for controller in (
        ForwardCommandController,
        GripperActionController,
        HoldController,
        HomingController,
        JogController,
        JointStateBroadcaster,
        JointTrajectoryController,
    )
}
