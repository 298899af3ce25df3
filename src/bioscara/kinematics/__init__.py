"""Forward and inverse kinematics of the arm, in closed form without iteration.

``pose`` is a position and a rotation about the vertical, ``joints`` the lengths, ranges and
positions of the joints, ``scara`` the arm for single poses in plain floats, ``batch`` the same for
whole arrays.
"""

from bioscara.kinematics.joints import (
    Geometry as Geometry,
    Joints as Joints,
    PositionLimits as PositionLimits,
)
from bioscara.kinematics.pose import IDENTITY as IDENTITY, Pose as Pose
from bioscara.kinematics.scara import Scara as Scara
