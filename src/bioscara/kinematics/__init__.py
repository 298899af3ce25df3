"""Where the tool is, given the joints, and the other way round: closed forms, no iteration.

``pose`` is a place and a turn about the vertical, ``joints`` what there is to know of the joints,
``scara`` the arm for single poses in plain floats, ``batch`` the same for whole arrays.
"""

from bioscara.kinematics.joints import Geometry as Geometry
from bioscara.kinematics.joints import Joints as Joints
from bioscara.kinematics.joints import Range as Range
from bioscara.kinematics.pose import IDENTITY as IDENTITY
from bioscara.kinematics.pose import Pose as Pose
from bioscara.kinematics.scara import Scara as Scara
