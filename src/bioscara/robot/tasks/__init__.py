"""The tasks of an arm: one frozen struct for each, and everything follows from it.

In: the arguments, checked. Out: a plan from where the arm is, or the operation that does it.
"""

from __future__ import annotations

from typing import get_args

from bioscara.robot.tasks.gripper import *  # noqa: F403  each says in __all__ what it has
from bioscara.robot.tasks.gripper import GripperTask
from bioscara.robot.tasks.motions import *  # noqa: F403
from bioscara.robot.tasks.motions import Home, Motion, Wait
from bioscara.robot.tasks.power import *  # noqa: F403
from bioscara.robot.tasks.power import PowerTask
from bioscara.robot.tasks.workspace import *  # noqa: F403
from bioscara.robot.tasks.workspace import WorkspaceTask

ArmTask = Motion | Home | GripperTask | PowerTask | WorkspaceTask | Wait
"""Everything that an arm can be asked to do."""

TASKS = get_args(ArmTask)
"""The classes of these."""
