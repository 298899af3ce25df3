"""A whole arm as one object: homing, motion, stopping and fault handling.

``robot`` has the robot class and its motions, ``connection`` its base class without motions,
``pose_motions`` and ``planner`` the motions of the tool, ``looking`` access to the state,
``fault_handling`` engaging the arm and recovery from faults, ``homing_rules`` the choice of the
joints that are homed together, ``gripper`` the gripper. ``call_arbiter`` admits one call at a
time. Below them, ``wiring`` selects the devices, ``stack`` assembles the control stack above the
devices, ``running`` runs the control loop during a motion, ``records`` builds the cycle records,
and ``pacing`` holds simulated time back to real time. ``tools`` and ``poses`` have the named tools
and poses, ``teach_file`` stores them.

Invariant: however a motion ends, every joint that can be reached is at rest before the caller
gets the exception, and one thread at a time communicates with the joints.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from bioscara.robot.tools import kinematics_of as kinematics_of

if TYPE_CHECKING:
    from bioscara.robot.connection import FAULTS as FAULTS
    from bioscara.robot.robot import Robot as Robot

_HOMES = {"FAULTS": "bioscara.robot.connection", "Robot": "bioscara.robot.robot"}


def __getattr__(name: str) -> object:
    # Lazy: planning alone does not import controllers and drivers.
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
