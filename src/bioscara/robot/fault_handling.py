"""Engaging the arm and dealing with what stopped it, for the robot."""

from __future__ import annotations

from bioscara.control.faults import Fault
from bioscara.control.supervisor import FaultState
from bioscara.hardware import State
from bioscara.robot.looking import Looking
from bioscara.robot.turn import exclusive


class FaultHandling(Looking):
    """Engaging and releasing the joints, and the way out of a fault; none of it moves anything."""

    @exclusive("enable()")
    def enable(self) -> None:
        """Engage all joints where they stand; nothing moves.

        Raises:
            FaultedError: A fault is latched.
            BusyError: Another call is using the arm.
            BioscaraError: A joint did not engage; all are released.
        """
        self._engage()

    def _engage(self) -> None:
        self._turn.require_wanted()
        stack = self._running()
        stack.supervisor.require_clear()
        if stack.arm.state is State.UNCONFIGURED:
            stack.arm.configure()
        if stack.arm.state is State.INACTIVE:
            stack.arm.activate()
            stack.loop.restart()
        stack.broadcast(self.clock.now())

    @exclusive("disable()")
    def disable(self) -> None:
        """Bring all joints to rest and release them; they stay homed.

        Raises:
            BusyError: Another call is using the arm; :meth:`stop` ends it.
        """
        stack = self._running()
        if stack.arm.state is State.ACTIVE:
            stack.manager.set_hardware_state(stack.arm.name, State.INACTIVE, self.clock.now())

    @property
    def faults(self) -> tuple[Fault, ...]:
        """What stopped the arm and is not recovered from, first cause first."""
        return tuple(self._running().supervisor.faults)

    @exclusive("clear_faults()")
    def clear_faults(self) -> list[str]:
        """Acknowledge the faults that joints latched before; nothing moves.

        Returns:
            A sentence for each.

        Raises:
            BusyError: Another call is using the arm.
        """
        return self._running().arm.clear_faults()

    @exclusive("acknowledge()")
    def acknowledge(self) -> tuple[Fault, ...]:
        """Take note of the faults once the arm stands: writes their evidence; nothing moves.

        Raises:
            FaultedError: There is none.
            OSError: The evidence cannot be written.
            BusyError: Another call is using the arm.
        """
        stack = self._running()
        stack.loop.restart()
        while stack.supervisor.state is FaultState.STOPPING:
            stack.loop.step()
        return tuple(stack.supervisor.acknowledge())

    @exclusive("recover()")
    def recover(self) -> None:
        """Clear acknowledged faults; nothing moves, and :meth:`enable` comes next.

        Raises:
            FaultedError: They are not acknowledged.
            BusyError: Another call is using the arm.
            BioscaraError: A joint does not answer.
        """
        stack, now = self._running(), self.clock.now()
        stack.supervisor.recover(now)
        stack.broadcast(now)
