"""From a name to a robot: of this process, or of an owner.

It is above robots and their clients, which do not know of each other, and has the class that
programs begin with.
"""

from __future__ import annotations

from bioscara.robot import Robot as Robot
from bioscara.robot.arm_methods import ArmMethods
from bioscara.robot.openers import OPENERS


def _owned(name: str, timeout: float) -> ArmMethods:
    # Most programs have no owner.
    from bioscara.remote import RemoteRobot  # noqa: PLC0415

    return RemoteRobot(name, timeout=timeout)


OPENERS["arm"] = _owned
