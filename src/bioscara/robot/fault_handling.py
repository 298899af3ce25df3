"""Dealing with what stopped the arm, for the robot."""

from __future__ import annotations

from abc import ABC, abstractmethod

from bioscara.clock import Clock
from bioscara.control.faults import Fault
from bioscara.control.supervisor import FaultState
from bioscara.robot.stack import Stack


class FaultHandling(ABC):
    """Faults and the three steps out of them; none of these moves anything.

    Attributes:
        clock: The arm's time.
    """

    clock: Clock

    @abstractmethod
    def _running(self) -> Stack:
        """Return what runs the arm; raises while the robot is not connected."""

    @property
    def faults(self) -> tuple[Fault, ...]:
        """What stopped the arm and is not recovered from, first cause first."""
        return tuple(self._running().supervisor.faults)

    def clear_faults(self) -> list[str]:
        """Acknowledge the faults that joints latched before; nothing moves.

        Returns:
            A sentence for each.
        """
        return self._running().arm.clear_faults()

    def acknowledge(self) -> tuple[Fault, ...]:
        """Take note of the faults once the arm stands: writes their evidence; nothing moves.

        Raises:
            FaultedError: There is none.
            OSError: The evidence cannot be written.
        """
        stack = self._running()
        stack.loop.restart()
        while stack.supervisor.state is FaultState.STOPPING:
            stack.loop.step()
        return tuple(stack.supervisor.acknowledge())

    def recover(self) -> None:
        """Clear acknowledged faults; nothing moves, and :meth:`enable` comes next.

        Raises:
            FaultedError: They are not acknowledged.
            BioscaraError: A joint does not answer.
        """
        stack, now = self._running(), self.clock.now()
        stack.supervisor.recover(now)
        stack.broadcast(now)
