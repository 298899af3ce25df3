"""The tasks of an arm: one frozen struct for each, and everything follows from it.

In: the arguments, checked. Out: a plan from where the arm is, or the operation that does it.
"""

from __future__ import annotations

from typing import get_args

from bioscara.robot.tasks.gripper import (
    CloseGripper as CloseGripper,
)
from bioscara.robot.tasks.gripper import (
    DisableGripper as DisableGripper,
)
from bioscara.robot.tasks.gripper import (
    EnableGripper as EnableGripper,
)
from bioscara.robot.tasks.gripper import (
    Grasp as Grasp,
)
from bioscara.robot.tasks.gripper import (
    MoveGripper as MoveGripper,
)
from bioscara.robot.tasks.gripper import (
    OpenGripper as OpenGripper,
)
from bioscara.robot.tasks.gripper import (
    Release as Release,
)
from bioscara.robot.tasks.motions import (
    Home as Home,
)
from bioscara.robot.tasks.motions import (
    MoveCircular as MoveCircular,
)
from bioscara.robot.tasks.motions import (
    MoveJoints as MoveJoints,
)
from bioscara.robot.tasks.motions import (
    MoveLinear as MoveLinear,
)
from bioscara.robot.tasks.motions import (
    MoveNamed as MoveNamed,
)
from bioscara.robot.tasks.motions import (
    MoveRelative as MoveRelative,
)
from bioscara.robot.tasks.motions import (
    MoveSequence as MoveSequence,
)
from bioscara.robot.tasks.motions import (
    MoveTo as MoveTo,
)
from bioscara.robot.tasks.motions import (
    Unfold as Unfold,
)
from bioscara.robot.tasks.power import (
    Acknowledge as Acknowledge,
)
from bioscara.robot.tasks.power import (
    Disable as Disable,
)
from bioscara.robot.tasks.power import (
    Enable as Enable,
)
from bioscara.robot.tasks.power import (
    Recover as Recover,
)
from bioscara.robot.tasks.workspace import (
    Attach as Attach,
)
from bioscara.robot.tasks.workspace import (
    ConfirmScene as ConfirmScene,
)
from bioscara.robot.tasks.workspace import (
    Detach as Detach,
)
from bioscara.robot.tasks.workspace import (
    SetReducedSpeed as SetReducedSpeed,
)
from bioscara.robot.tasks.workspace import (
    SetTool as SetTool,
)

Motion = (
    MoveJoints
    | MoveTo
    | MoveLinear
    | MoveRelative
    | MoveCircular
    | MoveNamed
    | MoveSequence
    | Unfold
)
"""The motions that can be planned."""

ArmTask = (
    Motion
    | Home
    | MoveGripper
    | OpenGripper
    | CloseGripper
    | Grasp
    | Release
    | Enable
    | Disable
    | EnableGripper
    | DisableGripper
    | Acknowledge
    | Recover
    | SetTool
    | SetReducedSpeed
    | Attach
    | Detach
    | ConfirmScene
)
"""Everything that an arm can be asked to do."""

TASKS = get_args(ArmTask)
"""The classes of these."""
