"""Joints and gripper as objects: SI joint units go in and come out, registers stay below.

``Joint`` is one axis and grows in layers, one file each: ``connection``, ``settings``, ``motion``,
``joint``. ``group`` serves several in one bus call. ``gripper`` and ``pwm`` are the servo,
``width_file`` what outlives it. Below them: ``transmission`` converts units, ``session`` is one
joint's frames, ``greeting`` its first, ``original`` the care that joints with their original
firmware need, ``refusal`` what becomes of those that failed,
``plausibility`` judges those that carry no check byte, ``sample`` and ``reports`` are what a joint
says, ``cycle`` is its part of a control cycle, ``waiting`` keeps a motion alive.
"""

from bioscara.drivers.cycle import Outcome as Outcome
from bioscara.drivers.greeting import await_power_up as await_power_up
from bioscara.drivers.gripper import Gripper as Gripper
from bioscara.drivers.gripper import GripperState as GripperState
from bioscara.drivers.gripper import calibrate as calibrate
from bioscara.drivers.group import drive as drive
from bioscara.drivers.group import read_states as read_states
from bioscara.drivers.group import track as track
from bioscara.drivers.joint import Joint as Joint
from bioscara.drivers.pwm import Pwm as Pwm
from bioscara.drivers.reports import FaultReport as FaultReport
from bioscara.drivers.reports import Hello as Hello
from bioscara.drivers.sample import JointSample as JointSample
from bioscara.drivers.sample import Quality as Quality
from bioscara.drivers.sample import Setpoint as Setpoint
from bioscara.drivers.transmission import Transmission as Transmission
