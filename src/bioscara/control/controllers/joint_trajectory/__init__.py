"""The joint trajectory controller of ros2_controllers: it follows the trajectories of goals.

Begin with ``controller``, which combines the others. ``goal_messages`` are its goals and answers,
``trajectory_parameters`` its parameters. ``goal_validation`` checks that a goal can be followed,
``goal_conversion`` makes a trajectory of it, ``upsampling`` smooths bare positions.
``interpolation`` is the curve through the points, ``sampler`` samples a curve and changes from one
to the next (``splicing``, ``braking``). ``tolerances`` holds the permitted deviations and evaluates
them, ``pid`` is the velocity controller of a joint, ``interfaces`` holds those of all joints.
"""

from bioscara.control.controllers.goal_handle import GoalStatus as GoalStatus
from bioscara.control.controllers.joint_trajectory.controller import (
    JointTrajectoryController as JointTrajectoryController,
)
from bioscara.control.controllers.joint_trajectory.goal_conversion import (
    PreparedGoal as PreparedGoal,
)
from bioscara.control.controllers.joint_trajectory.goal_messages import (
    ControllerState as ControllerState,
    ErrorCode as ErrorCode,
    Feedback as Feedback,
    Goal as Goal,
    GoalHandle as GoalHandle,
    JointTrajectory as JointTrajectory,
    Point as Point,
    Tolerance as Tolerance,
)
from bioscara.control.controllers.joint_trajectory.pid import Gains as Gains
