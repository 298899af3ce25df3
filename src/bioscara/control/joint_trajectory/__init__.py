"""The joint trajectory controller of ros2_controllers: goals come in, followed paths come out.

``messages`` is what it is asked and answers, ``validation`` whether that can be followed,
``course`` the curve through the points, ``tolerances`` how far joints may be off, ``pid`` the
velocity controller of a joint, ``controller`` the whole.
"""

from bioscara.control.joint_trajectory.controller import (
    JointTrajectoryController as JointTrajectoryController,
)
from bioscara.control.joint_trajectory.messages import Goal as Goal
from bioscara.control.joint_trajectory.messages import GoalHandle as GoalHandle
from bioscara.control.joint_trajectory.messages import JointTrajectory as JointTrajectory
from bioscara.control.joint_trajectory.messages import Point as Point
from bioscara.control.joint_trajectory.messages import Status as Status
from bioscara.control.joint_trajectory.messages import Tolerance as Tolerance
