"""Every controller type by the name that ROS gives it."""

from __future__ import annotations

from bioscara.control.controller import AnyController
from bioscara.control.forward_command_controller import ForwardCommandController
from bioscara.control.hold_controller import HoldController
from bioscara.control.joint_trajectory import JointTrajectoryController

TYPES: dict[str, type[AnyController]] = {
    controller.TYPE: controller
    for controller in (ForwardCommandController, HoldController, JointTrajectoryController)
}
