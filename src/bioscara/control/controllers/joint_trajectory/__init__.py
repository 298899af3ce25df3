"""The joint trajectory controller of ros2_controllers: it follows the trajectories of goals.

``messages`` holds its goals and answers, ``parameters`` its parameters, ``validation`` checks that
a goal can be followed, ``upsampling`` smooths bare positions, ``interpolation`` is the curve
through the points, ``requests`` holds a waiting trajectory, ``sampler`` samples a curve and changes
from one to the next (``splicing``, ``braking``), ``tolerances`` holds the permitted deviations and
evaluates them, ``pid`` is the velocity controller of a joint, ``interfaces`` holds those of all
joints, ``controller`` combines them.
"""

from bioscara.control.controllers.goals import GoalStatus as GoalStatus
from bioscara.control.controllers.joint_trajectory.controller import (
    JointTrajectoryController as JointTrajectoryController,
)
from bioscara.control.controllers.joint_trajectory.messages import (
    ControllerState as ControllerState,
)
from bioscara.control.controllers.joint_trajectory.messages import ErrorCode as ErrorCode
from bioscara.control.controllers.joint_trajectory.messages import Feedback as Feedback
from bioscara.control.controllers.joint_trajectory.messages import Goal as Goal
from bioscara.control.controllers.joint_trajectory.messages import GoalHandle as GoalHandle
from bioscara.control.controllers.joint_trajectory.messages import (
    JointTrajectory as JointTrajectory,
)
from bioscara.control.controllers.joint_trajectory.messages import Point as Point
from bioscara.control.controllers.joint_trajectory.messages import Tolerance as Tolerance
from bioscara.control.controllers.joint_trajectory.pid import Gains as Gains
from bioscara.control.controllers.joint_trajectory.requests import PreparedGoal as PreparedGoal
