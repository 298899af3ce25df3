"""Hardware components with ros2_control's lifecycle and named interfaces, without registers.

Begin with ``arm``, the joints of one bus, and ``axis``, one of them; ``gripper`` is the servo.
``component`` implements their lifecycle, ``interfaces`` the handles shared with controllers.
``mode_switching`` changes the joints' command modes, ``cyclic_io`` exchanges with them in each
cycle, ``safe_stop`` brings them to rest despite any failure. ``urdf`` reads a robot
description, ``urdf_joints`` its joints, ``link_frames`` the poses of its links.
"""

from bioscara.hardware.arm import ArmHardware as ArmHardware
from bioscara.hardware.command_modes import Mode as Mode
from bioscara.hardware.component import (
    HardwareComponent as HardwareComponent,
    LifecycleState as LifecycleState,
)
from bioscara.hardware.gripper import GripperHardware as GripperHardware
from bioscara.hardware.interfaces import (
    HOME as HOME,
    POSITION as POSITION,
    VELOCITY as VELOCITY,
    CommandInterface as CommandInterface,
    StateInterface as StateInterface,
)
from bioscara.hardware.urdf import Urdf as Urdf
