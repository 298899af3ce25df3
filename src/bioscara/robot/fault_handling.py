"""Engaging the arm and handling its faults, for the robot."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.control.faults.kinds import ArmFault
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import BioscaraError, HardwareError
from bioscara.hardware import LifecycleState
from bioscara.hardware.safe_stop import release
from bioscara.protocol import Flags
from bioscara.robot.call_arbiter import exclusive
from bioscara.robot.looking import Looking


class FaultHandling(Looking):
    """Engaging and releasing the joints, and recovery from faults; nothing moves."""

    @exclusive("enable()")
    def enable(self) -> None:
        """Engage all joints at their positions; nothing moves.

        Raises:
            FaultedError: A fault is latched, here or in a joint.
            BusyError: Another call is using the arm.
            BioscaraError: A joint did not engage; all are released, and the error is latched as a
                fault.
        """
        self._engage()

    def _engage(self) -> None:
        self._turn.require_wanted()
        stack = self._running()
        stack.supervisor.require_clear()
        if stack.arm.state is LifecycleState.UNCONFIGURED:
            stack.arm.configure()
        if stack.arm.state is LifecycleState.INACTIVE:
            # A joint may have stopped autonomously while its state was not read.
            self._take(stack.arm.latched(Flags.FAULT))
            stack.supervisor.require_clear()
            try:
                stack.arm.activate()
            except BioscaraError as error:
                self._take([error])
                raise stack.supervisor.faults[0].error() from None
            stack.loop.restart()
        stack.broadcast(self.clock.now())

    def _take(self, causes: Sequence[BioscaraError]) -> None:
        """Latch errors found on an arm at rest as its faults: recovery is the same for all."""
        stack = self._running()
        for cause in causes:
            stack.supervisor.fault(cause, stack.arm.name, self.clock.now())
        if causes:
            self._come_to_stand()

    def _come_to_stand(self) -> None:
        """Wait until a fault that stops the arm is latched."""
        stack = self._running()
        stack.loop.restart()
        while stack.supervisor.state is FaultState.STOPPING:
            stack.loop.step()

    @exclusive("disable()")
    def disable(self) -> None:
        """Bring all joints to rest and release them; they stay homed.

        Raises:
            BusyError: Another call is using the arm; :meth:`stop` ends it.
            HardwareError: A joint could not be stopped or released; call it again.
        """
        stack = self._running()
        if stack.arm.state is LifecycleState.ACTIVE:
            stack.manager.set_hardware_state(
                stack.arm.name, LifecycleState.INACTIVE, self.clock.now()
            )
        elif problems := release(stack.arm.joints):
            raise HardwareError("; ".join(problems), stack.arm.name)

    @property
    def faults(self) -> tuple[ArmFault, ...]:
        """Faults that are not recovered from, first cause first.

        Includes faults that joints had latched before this robot was connected.
        """
        return tuple(self._running().supervisor.faults)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The latest warnings: events that stopped nothing, such as a computer that is too slow."""
        return tuple(self._running().supervisor.warnings)

    @exclusive("acknowledge()")
    def acknowledge(self) -> tuple[ArmFault, ...]:
        """Acknowledge the faults once the arm is at rest and write their evidence; nothing moves.

        Raises:
            FaultedError: There is no fault.
            OSError: The evidence cannot be written.
            BusyError: Another call is using the arm.
        """
        self._cycle()
        self._come_to_stand()
        return tuple(self._running().supervisor.acknowledge())

    @exclusive("recover()")
    def recover(self) -> None:
        """Clear acknowledged faults; nothing moves, and :meth:`enable` is the next step.

        Raises:
            FaultedError: The faults are not acknowledged, or another one has occurred since.
            BusyError: Another call is using the arm.
            BioscaraError: A joint does not answer.
        """
        # Faults that occurred since the last cycle must not be cleared unseen.
        self._cycle()
        stack, now = self._running(), self.clock.now()
        stack.supervisor.recover(now)
        stack.broadcast(now)
