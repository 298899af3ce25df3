"""Every controller type by the name that ROS gives it."""

from __future__ import annotations

from bioscara.control.controllers.controller import AnyController
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.controllers.gripper_action_controller import GripperActionController
from bioscara.control.controllers.hold_controller import HoldController
from bioscara.control.controllers.homing_controller import HomingController
from bioscara.control.controllers.jog_controller import JogController
from bioscara.control.controllers.joint_state_broadcaster import JointStateBroadcaster
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController

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
