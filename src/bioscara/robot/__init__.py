"""A whole arm as one object: home it, move it, stop it, deal with its faults.

``robot`` has the one object and its motions, ``connection`` what it is without them,
``pose_motions`` and ``planner`` the motions of the tool, ``looking`` what is seen of it,
``fault_handling`` engaging it and the way out of a fault, ``homing_rules`` which joints are homed
together, ``gripper`` the jaws. ``call_arbiter`` lets one
call at a time use it. Behind them ``wiring`` finds the devices, ``stack`` wires everything above
these, ``running`` keeps the loop going while something moves, ``records`` is what the joints said,
``pacing`` simulated time for people who watch. ``tools`` and ``poses`` are what has a name,
``teach_file`` keeps it.

Law: whatever ends a motion, every joint that can be reached is at rest before control returns to
the caller's exception, and one thread at a time speaks with them.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from bioscara.robot.tools import kinematics_of as kinematics_of

if TYPE_CHECKING:
    from bioscara.robot.connection import FAULTS as FAULTS
    from bioscara.robot.robot import Robot as Robot

_HOMES = {"FAULTS": "bioscara.robot.connection", "Robot": "bioscara.robot.robot"}


def __getattr__(name: str) -> object:
    # Whoever only plans does not wait for controllers and drivers to be imported.
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
