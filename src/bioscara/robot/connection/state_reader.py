"""Read access to the joint states."""

from __future__ import annotations

import math

from bioscara.control.controllers.joint_state_broadcaster import JointStates
from bioscara.errors import BioscaraError, NotHomedError
from bioscara.kinematics import Joints
from bioscara.robot.connection.arm_session import ArmSession


class StateReader:
    """Reads the joint states, from any thread, also while another thread moves the arm.

    Args:
        session: ArmSession of the arm.
    """

    def __init__(self, session: ArmSession) -> None:
        self._session = session

    def read(self) -> JointStates:
        """Return the joint states: of the last cycle of the running call, else read now.

        Raises:
            BusyError: The running call has not read the joints yet.
            FaultedError: The joints were released because of a fault, and are not recovered.
            BioscaraError: They were released without a fault.
        """
        stack = self._session.stack
        busy = self._session.arbiter.read_unless_busy(self._refresh)
        states = stack.broadcaster.states
        if states is None:
            if busy is not None:
                raise busy.refuse("state")
            stack.supervisor.require_clear()
            raise BioscaraError("the joints are released and report no state; enable() them")
        return states

    def positions(self, reason: str = "its position is unknown; home() first") -> Joints:
        """Return the joint positions [rad, m, rad, rad].

        Args:
            reason: Why a joint that is not homed is refused, for the message.

        Raises:
            NotHomedError: The position of a joint is unknown.
            BioscaraError: As :meth:`read`.
        """
        states = self.read()
        for name, position in zip(states.names, states.positions, strict=True):
            if math.isnan(position):
                raise NotHomedError(f"{name} is not homed: {reason}", name)
        return Joints(*states.positions)

    def _refresh(self) -> None:
        """Read the joints, unless they were read within the last two cycles."""
        stack = self._session.stack
        states = stack.broadcaster.states
        now = self._session.clock.now()
        if states is None or now - states.time > 2.0 * stack.loop.period:
            stack.cycle()
