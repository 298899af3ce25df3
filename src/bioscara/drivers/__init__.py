"""Joint and gripper drivers; their interfaces use SI joint units and hide the registers.

``joint`` handles one axis, or several in one bus call; ``link`` the frames exchanged with them;
``gripper`` the servo.
"""

from bioscara.drivers.gripper.gripper import (
    Gripper as Gripper,
    GripperState as GripperState,
    calibrate as calibrate,
)
from bioscara.drivers.gripper.pwm import Pwm as Pwm
from bioscara.drivers.joint.capture import Capture as Capture
from bioscara.drivers.joint.cyclic import Outcome as Outcome
from bioscara.drivers.joint.group import drive as drive, read_states as read_states, track as track
from bioscara.drivers.joint.joint import Joint as Joint
from bioscara.drivers.joint.sample import (
    JointSample as JointSample,
    Quality as Quality,
    Setpoint as Setpoint,
)
from bioscara.drivers.joint.transmission import Transmission as Transmission
from bioscara.drivers.link.handshake import (
    acknowledges as acknowledges,
    await_power_up as await_power_up,
)
from bioscara.drivers.link.joint_reports import (
    ExceptionReport as ExceptionReport,
    FaultReport as FaultReport,
    Hello as Hello,
)
from bioscara.drivers.link.line import line_of as line_of
