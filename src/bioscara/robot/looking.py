"""What is seen of the arm, for the robot."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

from bioscara.clock import Clock
from bioscara.control.controllers.joint_state_broadcaster import JointStates
from bioscara.errors import BioscaraError, NotHomedError
from bioscara.kinematics import Joints, Pose, Scara
from bioscara.model import ArmParameters
from bioscara.robot.call_arbiter import CallArbiter
from bioscara.robot.planner import Planner
from bioscara.robot.stack import Stack


class Looking(ABC):
    """Looks at the arm; any thread may, also while a call of another one moves it.

    Attributes:
        clock: The arm's time.
        parameters: The arm as data.
        plan: Plans motions from where the arm is, without moving.
    """

    clock: Clock
    parameters: ArmParameters
    plan: Planner
    _turn: CallArbiter

    @abstractmethod
    def _running(self) -> Stack:
        """Return what runs the arm; raises while the robot is not connected."""

    @property
    def state(self) -> JointStates:
        """What the joints are seen to do: in the last cycle of the call that runs, else now.

        Raises:
            BusyError: The call that runs has not asked the joints yet.
            FaultedError: The joints were let go because of a fault, and are not recovered.
            BioscaraError: They were let go without one: ``enable()`` them.
        """
        stack = self._running()
        busy = self._turn.look(self._refresh)
        states = stack.broadcaster.states
        if states is None:
            if busy is not None:
                raise busy.refuse("state")
            stack.supervisor.require_clear()
            raise BioscaraError("the joints were let go and tell nothing; enable() them")
        return states

    @property
    def pose(self) -> Pose:
        """Where the tool is, in the base; as old as ``state``.

        Raises:
            NotHomedError: A joint does not know its position.
            BusyError: As ``state``.
        """
        state = self.state
        for name, position in zip(state.names, state.positions, strict=True):
            if math.isnan(position):
                raise NotHomedError(f"{name} is not homed: the tool could be anywhere", name)
        return self.plan.kinematics.forward(state.positions)

    @property
    def kinematics(self) -> Scara:
        """Of the arm with its tool."""
        return self.plan.kinematics

    @property
    def period(self) -> float:
        """Time between two setpoints [s]."""
        return self._running().loop.period

    def _here(self) -> Joints:
        """Return where the joints are [rad, m, rad, rad]."""
        state = self.state
        for name, position in zip(state.names, state.positions, strict=True):
            if math.isnan(position):
                raise NotHomedError(
                    f"{name} is not homed: its position is unknown; home() first", name
                )
        return Joints(*state.positions)

    def _refresh(self) -> None:
        """Ask the joints, unless that was done a moment ago."""
        stack = self._running()
        states = stack.broadcaster.states
        if states is None or self.clock.now() - states.time > 2.0 * stack.loop.period:
            self._cycle()

    def _cycle(self) -> None:
        stack = self._running()
        stack.loop.restart()
        stack.loop.step()
