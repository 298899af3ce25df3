"""The joint trajectory controller of ros2_controllers: goals come in, followed paths come out.

``messages`` is what it is asked and answers, ``parameters`` what it is told beforehand,
``validation`` whether the former can be followed, ``upsampling`` smooths bare positions, ``course``
is the curve through the points, ``requests`` one that waits, ``sampler`` goes along it and from one
to the next (``splicing``, ``stopping``), ``tolerances`` is how far joints may be off, ``judging``
what follows from it, ``pid`` the velocity controller of a joint, ``handles`` the interfaces of all,
``controller`` the whole.
"""

from bioscara.control.controllers.goals import Status as Status
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
