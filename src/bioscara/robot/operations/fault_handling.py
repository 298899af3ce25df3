"""The steps from a latched fault to an arm that can be enabled again; nothing moves."""

from __future__ import annotations

from contextlib import suppress

from bioscara.control.faults.kinds import ArmFault
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import RecordingError
from bioscara.robot.arm import Arm
from bioscara.robot.operations.arbiter import EVERYTHING
from bioscara.robot.operations.operation import Cycles, Operation


def keep_evidence(arm: Arm) -> None:
    """Write the evidence of the faults of an arm at rest, between two cycles.

    A full disk does not undo a stop: then acknowledging writes the evidence again.
    """
    supervisor = arm.stack.supervisor
    with suppress(OSError):
        supervisor.keep_evidence()
    for fault in supervisor.faults:
        fault.error()  # the exception that is being raised names its evidence, too
    # The disk may take longer than a cycle, which harms nothing while the arm is at rest.
    arm.stack.loop.restart()


class Acknowledge(Operation[tuple[ArmFault, ...]]):
    """Acknowledges the faults once the arm is at rest, and writes their evidence."""

    devices = EVERYTHING

    def cycles(self, arm: Arm) -> Cycles[tuple[ArmFault, ...]]:
        """Run cycles until the arm is at rest; return the faults."""
        stack = arm.stack
        arm.restart_loop(self)
        yield None
        arm.restart_loop(self)
        while stack.supervisor.state is FaultState.STOPPING:
            yield None
        try:
            return tuple(stack.supervisor.acknowledge())
        except OSError as error:
            raise RecordingError(
                f"acknowledge(): the evidence of the fault cannot be written: {error}; free space "
                "there, or make the folder writable, and acknowledge() again"
            ) from error
        finally:
            stack.loop.restart()


class Recover(Operation[None]):
    """Clears acknowledged faults, here and in the joints."""

    devices = EVERYTHING

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Clear the faults after a cycle: one that occurred since the last must not go unseen."""
        stack = arm.stack
        arm.restart_loop(self)
        yield None
        now = arm.session.clock.now()
        stack.supervisor.recover(now)
        stack.broadcast(now)
        # Recovery takes longer than a cycle.
        arm.restart_loop(self)
