"""Grasping and releasing of loads."""

from __future__ import annotations

import math
from contextlib import suppress

from bioscara.arguments import number, shown
from bioscara.control.controllers.gripper_messages import GripperGoal, GripperResult
from bioscara.errors import InvalidArgumentError, NotHomedError
from bioscara.robot.arm import Arm
from bioscara.robot.operations.arbiter import EVERYTHING
from bioscara.robot.operations.change_workspace import ChangeWorkspace
from bioscara.robot.operations.motions.move_gripper import MoveGripper
from bioscara.robot.operations.operation import Cycles, OnCycle
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.workspace import Workspace

SQUEEZE = 3e-3
"""Usual difference of a load's width and the commanded one, for the force of the jaws [m]."""
OPENING = 0.01
"""Usual width by which the jaws open to release a load [m]."""


class Grasp(MoveGripper):
    """Closes the jaws on a load and attaches it, while the arm rests.

    Args:
        load: The load.
        width: Its width where the jaws hold it [m]; None for that of its shape.
        squeeze: By how much the commanded width is smaller [m].
        timeout: Longest duration [s].
        on_cycle: Receives the record of each cycle.
    """

    devices = EVERYTHING

    def __init__(
        self,
        load: Load,
        width: float | None = None,
        squeeze: float = SQUEEZE,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
    ) -> None:
        self._load = _require_load(load)
        self._load_width = load.width if width is None else number("the width", width)
        squeeze = number("the squeeze", squeeze)
        if not 0.0 <= squeeze < self._load_width:
            raise InvalidArgumentError(
                f"the squeeze of {squeeze:g} m is outside 0 .. {self._load_width:g} m, the width "
                f"of {load.name}; are these millimetres?"
            )
        commanded = self._load_width - squeeze
        super().__init__(commanded, name="gripper.grasp()", timeout=timeout, on_cycle=on_cycle)

    def prepare(self, arm: Arm) -> None:
        """Check that the jaws may close and that the load is clear where the arm is."""
        arm.stack.gripper.check(GripperGoal((self._width,)))
        super().prepare(arm)
        _attached(arm, self._load)

    def cycles(self, arm: Arm) -> Cycles[GripperResult]:
        """Close the jaws, then attach the load."""
        result = yield from super().cycles(arm)
        arm.jaws.hold(self._load_width)
        arm.use_workspace(_attached(arm, self._load))
        return result


class Release(MoveGripper):
    """Opens the jaws and detaches the load, while the arm rests.

    Args:
        opening: By how much the jaws open [m]; to the largest width if the servo is not driven.
        timeout: Longest duration [s].
        on_cycle: Receives the record of each cycle.
    """

    devices = EVERYTHING
    _needs_confirmed_scene = False  # It is how a load of the last run is taken off.

    def __init__(
        self,
        opening: float = OPENING,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
    ) -> None:
        self._opening = number("the opening", opening)
        if not self._opening > 0.0:
            raise InvalidArgumentError(f"the opening of {1e3 * opening:g} mm must be above zero")
        super().__init__(0.0, name="gripper.release()", timeout=timeout, on_cycle=on_cycle)

    def prepare(self, arm: Arm) -> None:
        """Find the width at which the jaws are open."""
        arm.workspace.without_load()
        driven = not math.isnan(arm.jaws.commanded)
        _, high = arm.jaws.range()
        self._width = high + self._opening if driven else high
        arm.stack.gripper.check(GripperGoal((self._width,)))

    def cycles(self, arm: Arm) -> Cycles[GripperResult]:
        """Open the jaws, then detach the load."""
        result = yield from super().cycles(arm)
        arm.use_workspace(arm.workspace.without_load())
        return result


class Attach(ChangeWorkspace):
    """Declares that the tool carries a load; nothing moves.

    Args:
        load: The load.
    """

    def __init__(self, load: Load) -> None:
        super().__init__("attach()", lambda workspace: workspace.with_load(load))
        self._load = _require_load(load)

    def prepare(self, arm: Arm) -> None:
        """Check that the load is clear where the arm is."""
        super().prepare(arm)
        _attached(arm, self._load)


def _require_load(load: Load) -> Load:
    if not isinstance(load, Load):
        raise InvalidArgumentError(f"the load is {shown(load)}; give Load(name, shape)")
    return load


def _attached(arm: Arm, load: Load) -> Workspace:
    """Return the workspace with a load, which is clear where the arm is.

    Raises:
        ZoneError: It is too near to a body that it may not touch.
    """
    workspace = arm.workspace.with_load(load)
    # The positions of an arm that is not homed are unknown: then nothing is checked.
    with suppress(NotHomedError):
        workspace.surroundings.check_load(workspace.kinematics, arm.positions())
    return workspace
