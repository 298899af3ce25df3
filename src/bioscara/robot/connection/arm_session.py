"""One arm from connecting to shutdown."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import closing
from pathlib import Path

from bioscara.arguments import shown
from bioscara.bus import Bus
from bioscara.clock import Clock, Waits
from bioscara.control.faults.kinds import FaultKind, reports_missing_supply
from bioscara.control.manager.update_rate import require_rate
from bioscara.drivers import Gripper
from bioscara.errors import (
    BioscaraError,
    HardwareError,
    InvalidArgumentError,
    LifecycleError,
    NotInitializedError,
)
from bioscara.hardware import ArmHardware, GripperHardware, LifecycleState
from bioscara.hardware.safe_stop import release
from bioscara.model import ArmParameters
from bioscara.processes.forking import Maker, in_child
from bioscara.protocol import Flags
from bioscara.robot.connection.stack import Stack
from bioscara.robot.workspace.workspace import Workspace

FAULTS = Path("faults")
"""Folder for the flight records of faults, unless another one is named."""


class ArmSession:
    """Connects, enables, disables and shuts down one arm; nothing here makes it move.

    Args:
        bus: The bus of the joints.
        clock: Clock of the arm.
        parameters: Parameters of the arm.
        gripper: The driver of the gripper.
        rate: Control cycles per second [Hz]; None for the rate that suits the joints.
        evidence: Folder for the flight records of faults.

    Attributes:
        bus: The bus of the joints.
        clock: Clock of the arm.
        parameters: Parameters of the arm.
        begin: Time at which the session was created [s].
        hardware: Hardware component of the joints.
        gripper: Hardware component of the gripper.
        maker: The process that has made it; in a forked child calls are refused.

    Raises:
        InvalidArgumentError: The rate or the folder is invalid.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        parameters: ArmParameters,
        gripper: Gripper,
        *,
        rate: int | None,
        evidence: Path | str,
    ) -> None:
        if not isinstance(evidence, str | Path):
            raise InvalidArgumentError(f"evidence is {shown(evidence)}; give the path of a folder")
        self.bus, self.clock, self.parameters = bus, clock, parameters
        self.begin = clock.now()
        self.hardware = ArmHardware("bioscara_arm", bus, clock, parameters.joints)
        self.gripper = GripperHardware("bioscara_gripper_128", "gripper", gripper, clock)
        self._rate = None if rate is None else require_rate(rate)
        self._evidence = Path(evidence)
        self._stack: Stack | None = None
        self.maker = Maker("the robot", "make a robot of its own here")
        in_child(self._forget)

    def _forget(self) -> None:
        self._stack = None

    @property
    def stack(self) -> Stack:
        """The control stack.

        Raises:
            NotInitializedError: The robot is not connected, or belongs to a parent process.
        """
        self.maker.require()
        if self._stack is None and self.hardware.state is not LifecycleState.UNCONFIGURED:
            raise NotInitializedError("the robot was closed; make another one to connect again")
        if self._stack is None:
            raise NotInitializedError(
                "the robot is not connected: open() it, or use it in a with statement"
            )
        return self._stack

    @property
    def connected(self) -> bool:
        """Whether the bus is open and the joints are connected."""
        return self._stack is not None

    def require_unconnected(self) -> None:
        """Raise unless it can be connected.

        Raises:
            LifecycleError: It is connected.
        """
        if self._stack is not None:
            raise LifecycleError("the robot is connected already; use the one there is")

    def connect(self, workspace: Workspace) -> None:
        """Open the bus, connect to the joints and run the first control cycle; nothing moves.

        Args:
            workspace: Tool, scene and speed limit, as for :class:`Stack`.

        Raises:
            LifecycleError: The robot is connected, or was shut down.
            BioscaraError: A joint cannot be used; the bus is closed again.
        """
        self.require_unconnected()
        if self.hardware.state is not LifecycleState.UNCONFIGURED:
            raise LifecycleError("the robot was closed; make another one to connect again")
        try:
            self.hardware.configure()
            stack = self._stack = Stack(
                self.hardware,
                self.gripper,
                workspace,
                self.clock,
                self._rate,
                self._evidence,
            )
            stack.broadcast(self.clock.now())
            # Notifies systemd of readiness and starts the evidence of faults latched earlier.
            stack.cycle()
            stack.latch(self.hardware.latched(Flags.FAULT | Flags.STALL), self.clock.now())
        except BaseException:
            self._stack = None
            self.bus.close()
            raise

    def enabling(self, admit: Callable[[], object]) -> Generator[None, None, None]:
        """Enable all joints at their positions, unless they are enabled; nothing moves.

        It takes up to 3 s, and runs up to each control cycle that is due meanwhile.

        Args:
            admit: Called after each of these cycles; raises to release the joints again.

        Raises:
            FaultedError: A fault is latched, here or in a joint.
            BioscaraError: A joint was not enabled; all are released, and the error is latched as
                a fault.
        """
        stack = self.stack
        stack.supervisor.require_clear()
        if self.hardware.state is LifecycleState.UNCONFIGURED:
            self.hardware.configure()
        if self.hardware.state is LifecycleState.INACTIVE:
            # A joint may have stopped autonomously while its state was not read.
            stack.latch(self.hardware.latched(Flags.FAULT), self.clock.now())
            stack.supervisor.require_clear()
            with closing(self.hardware.activating()) as waits:
                while (due := self._next_wait(waits)) is not None:
                    stack.loop.restart()
                    while self.clock.now() < due:
                        yield
                        stack.supervisor.require_clear()
                        admit()
            stack.loop.restart()
        stack.broadcast(self.clock.now())

    def _next_wait(self, waits: Waits) -> float | None:
        """Return the end of the next wait of enabling [s]; None at its end."""
        stack = self.stack
        try:
            return next(waits, None)
        except BioscaraError as error:
            # The others are not enabled after one has failed, so it stands for all of them.
            kind = FaultKind.POWER_LOST if reports_missing_supply(error) else None
            stack.latch([error], self.clock.now(), kind)
            raise stack.supervisor.faults[0].error() from None

    def disabling(self) -> Generator[None, None, None]:
        """Bring all joints to rest and disable them; runs up to each control cycle meanwhile.

        Raises:
            HardwareError: A joint could not be stopped or disabled.
        """
        stack = self.stack
        if self.hardware.state is LifecycleState.ACTIVE:
            stack.manager.release(self.hardware, self.clock.now())
            with closing(self.hardware.deactivating()) as waits:
                for due in waits:
                    # The step before may have taken longer than a cycle.
                    stack.loop.restart()
                    while self.clock.now() < due:
                        yield
        elif problems := release(self.hardware.joints):
            raise HardwareError("; ".join(problems), self.hardware.name)

    def shutdown(self) -> list[str]:
        """Stop and disable all joints; does nothing if that is done already.

        Returns:
            A sentence for each joint that could not be stopped or disabled.
        """
        if self._stack is None:
            return []
        if self._stack.watchdog is not None:
            self._stack.watchdog.close()
        problems = release(self.hardware.joints)
        # Not before: after an interruption, shutdown() can be called again.
        self._stack = None
        return problems
