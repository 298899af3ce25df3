"""Faults of the arm: reading, acknowledging and clearing them; nothing moves."""

from __future__ import annotations

from bioscara.control.faults.kinds import ArmFault
from bioscara.robot.connection.arm_session import ArmSession


class FaultRecovery:
    """The steps from a latched fault to an arm that can be enabled again.

    Args:
        session: ArmSession of the arm.
    """

    def __init__(self, session: ArmSession) -> None:
        self._session = session

    @property
    def faults(self) -> tuple[ArmFault, ...]:
        """Faults that are not recovered from, first cause first."""
        return tuple(self._session.stack.supervisor.faults)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The latest warnings, oldest first."""
        return tuple(self._session.stack.supervisor.warnings)

    def acknowledge(self) -> tuple[ArmFault, ...]:
        """Acknowledge the faults once the arm is at rest and write their evidence.

        Raises:
            FaultedError: There is no fault.
            OSError: The evidence cannot be written.
        """
        stack = self._session.stack
        stack.cycle()
        stack.finish_stopping()
        return tuple(stack.supervisor.acknowledge())

    def recover(self) -> None:
        """Clear acknowledged faults, here and in the joints.

        Raises:
            FaultedError: The faults are not acknowledged, or another one has occurred since.
            BioscaraError: A joint does not answer.
        """
        stack = self._session.stack
        # Faults that occurred since the last cycle must not be cleared unseen.
        stack.cycle()
        now = self._session.clock.now()
        stack.supervisor.recover(now)
        stack.broadcast(now)
