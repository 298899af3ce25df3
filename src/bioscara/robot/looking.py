"""Read access to the state of the arm, for the robot."""

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
    """Reads the state of the arm, from any thread, also while another thread moves the arm.

    Attributes:
        clock: Clock of the arm.
        parameters: Parameters of the arm.
        plan: Plans motions from the arm's current position, without moving.
    """

    clock: Clock
    parameters: ArmParameters
    plan: Planner
    _turn: CallArbiter

    @abstractmethod
    def _running(self) -> Stack:
        """Return the control stack; raises while the robot is not connected."""

    @property
    def state(self) -> JointStates:
        """Joint states: of the last cycle of the running call, else read now.

        Raises:
            BusyError: The running call has not read the joints yet.
            FaultedError: The joints were released because of a fault, and are not recovered.
            BioscaraError: They were released without a fault: ``enable()`` them.
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
        """Pose of the tool in the base; as old as ``state``.

        Raises:
            NotHomedError: The position of a joint is unknown.
            BusyError: As ``state``.
        """
        state = self.state
        for name, position in zip(state.names, state.positions, strict=True):
            if math.isnan(position):
                raise NotHomedError(f"{name} is not homed: the tool could be anywhere", name)
        return self.plan.kinematics.forward(state.positions)

    @property
    def kinematics(self) -> Scara:
        """Kinematics of the arm with its tool."""
        return self.plan.kinematics

    @property
    def period(self) -> float:
        """Time between two setpoints [s]."""
        return self._running().loop.period

    def _here(self) -> Joints:
        """Return the joint positions [rad, m, rad, rad]."""
        state = self.state
        for name, position in zip(state.names, state.positions, strict=True):
            if math.isnan(position):
                raise NotHomedError(
                    f"{name} is not homed: its position is unknown; home() first", name
                )
        return Joints(*state.positions)

    def _refresh(self) -> None:
        """Read the joints, unless they were read within the last two cycles."""
        stack = self._running()
        states = stack.broadcaster.states
        if states is None or self.clock.now() - states.time > 2.0 * stack.loop.period:
            self._cycle()

    def _cycle(self) -> None:
        stack = self._running()
        stack.loop.restart()
        stack.loop.step()
