"""Devices with ros2_control's lifecycle: registers stay below, named interfaces come out.

``arm`` is the joints of one bus, ``gripper`` the servo; ``description`` reads what they are from a
URDF, which ``urdf_reader`` parses. ``interfaces`` has the handles that controllers share with
them, ``modes`` which of these exclude one another, ``switching`` how modes change, ``component``
the ``lifecycle``, ``axis`` and ``homing`` one joint from cycle to cycle, ``exchange`` what is said
to all, ``capacity`` how much of that the bus can carry, ``stopping`` the way to rest that cannot
fail.
"""

from bioscara.hardware.arm import ArmHardware as ArmHardware
from bioscara.hardware.component import HardwareComponent as HardwareComponent
from bioscara.hardware.gripper import GripperHardware as GripperHardware
from bioscara.hardware.interfaces import HOME as HOME
from bioscara.hardware.interfaces import POSITION as POSITION
from bioscara.hardware.interfaces import VELOCITY as VELOCITY
from bioscara.hardware.interfaces import CommandInterface as CommandInterface
from bioscara.hardware.interfaces import StateInterface as StateInterface
from bioscara.hardware.lifecycle import State as State
from bioscara.hardware.modes import Mode as Mode
from bioscara.hardware.urdf_reader import Urdf as Urdf
