"""Joint and gripper drivers; their interfaces use SI joint units and hide the registers.

``joint`` handles one axis, or several in one bus call; ``link`` the frames exchanged with them;
``gripper`` the servo.
"""

from bioscara.drivers.gripper.gripper import Gripper as Gripper
from bioscara.drivers.gripper.gripper import GripperState as GripperState
from bioscara.drivers.gripper.gripper import calibrate as calibrate
from bioscara.drivers.gripper.pwm import Pwm as Pwm
from bioscara.drivers.joint.capture import Capture as Capture
from bioscara.drivers.joint.cyclic import Outcome as Outcome
from bioscara.drivers.joint.group import drive as drive
from bioscara.drivers.joint.group import read_states as read_states
from bioscara.drivers.joint.group import track as track
from bioscara.drivers.joint.joint import Joint as Joint
from bioscara.drivers.joint.sample import JointSample as JointSample
from bioscara.drivers.joint.sample import Quality as Quality
from bioscara.drivers.joint.sample import Setpoint as Setpoint
from bioscara.drivers.joint.transmission import Transmission as Transmission
from bioscara.drivers.link.handshake import acknowledges as acknowledges
from bioscara.drivers.link.handshake import await_power_up as await_power_up
from bioscara.drivers.link.joint_reports import ExceptionReport as ExceptionReport
from bioscara.drivers.link.joint_reports import FaultReport as FaultReport
from bioscara.drivers.link.joint_reports import Hello as Hello
from bioscara.drivers.link.line import line_of as line_of
