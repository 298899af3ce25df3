"""A whole arm as one object: homing, motion, stopping and fault handling.

Begin with ``robot``: ``Robot`` is the public interface. ``arm`` has the parts of the arm, and
``runner`` runs its control loop with the ``operations``, one at a time on each device.
``connection`` connects, enables and shuts down the arm, ``planner`` plans from where it is without
moving, and ``workspace`` has the other inputs of motions: tool, scene, load, speed limit, named
poses and frames.

Invariant: however a motion ends, every joint that can be reached is at rest before the caller gets
the exception, and one thread at a time communicates with the joints.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from bioscara.robot.workspace.tools import kinematics_of as kinematics_of

if TYPE_CHECKING:
    from bioscara.robot.connection.arm_session import FAULTS as FAULTS
    from bioscara.robot.robot import Robot as Robot

_HOMES = {"FAULTS": "bioscara.robot.connection.arm_session", "Robot": "bioscara.robot.robot"}


__all__ = ["FAULTS", "Robot", "kinematics_of"]


def __getattr__(name: str) -> object:
    # Lazy: planning alone does not import controllers and drivers.
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
