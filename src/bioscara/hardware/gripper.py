"""The gripper as a hardware component."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress

from bioscara.clock import Clock
from bioscara.drivers import Gripper, Quality
from bioscara.errors import GripperError
from bioscara.hardware.component import HardwareComponent, LifecycleState
from bioscara.hardware.interfaces import POSITION, VELOCITY, CommandInterface, StateInterface
from bioscara.model import JointParameters


class GripperHardware(HardwareComponent):
    """Servo that receives a width and gives no feedback.

    It publishes the commanded width, of quality ASSUMED while the servo is driven and
    UNKNOWN otherwise: then the jaws may be moved by hand.

    Args:
        name: Name of the component.
        joint: Name of its joint.
        gripper: The driver.
        clock: Clock of the time stamps.
    """

    def __init__(self, name: str, joint: str, gripper: Gripper, clock: Clock) -> None:
        super().__init__(name, "system")
        self._gripper, self._clock = gripper, clock
        self._position = StateInterface(joint, POSITION)
        self._velocity = StateInterface(joint, VELOCITY)
        self._command = CommandInterface(joint, POSITION)
        self._sent = self._before = gripper.state.width
        self._claimed = False
        self.states = {state.name: state for state in (self._position, self._velocity)}
        self.commands = {self._command.name: self._command}

    @property
    def limits(self) -> Mapping[str, JointParameters]:
        """None: the driver bounds the width."""
        return {}

    def on_configure(self) -> None:
        """Check that there is an output; nothing is written."""
        self._gripper.check()

    def on_activate(self) -> None:
        """Drive the servo at its present width, which becomes the command."""
        self._gripper.enable()
        self._sent = self._before = self._command.value = self._gripper.state.width
        self._publish(0.0)

    def on_deactivate(self) -> None:
        """Store the width and release the servo."""
        self._claimed = False
        self._gripper.disable()
        self._forget()

    def on_cleanup(self) -> None:
        """Do nothing: there is nothing to release."""

    def on_shutdown(self, before: LifecycleState) -> None:
        """Store the width and release the servo."""
        self._claimed = False
        self._gripper.disable()

    def on_error(self, before: LifecycleState) -> None:
        """Release the servo; its width is not stored, since this may run within a cycle.

        The error that led here is already known; a servo that is still driven is detected at the
        next activation.
        """
        self._claimed = False
        with suppress(GripperError):
            self._gripper.disable(store=False)

    def keep(self, width: float | None = None) -> None:
        """Store a width against a loss of power; waits for the disk, so never within a cycle.

        Args:
            width: Width to be commanded [m]; None for the width commanded last.

        Raises:
            GripperError: The state file cannot be written; nothing moved.
        """
        self._gripper.store_width(width)

    def read(self, time: float, period: float) -> None:
        """Publish the commanded width, and its mean velocity over the last period."""
        self.problems.clear()
        if self.state is LifecycleState.ACTIVE:
            self._publish((self._sent - self._before) / period if period > 0.0 else 0.0)
            self._before = self._sent

    def write(self, time: float, period: float) -> None:
        """Send the servo a new width; an unchanged width is not sent again.

        A width that cannot be sent is abandoned, and a gripped object stays gripped: the command
        becomes the previous width and has a problem. Nothing is stored here: see :meth:`keep`.
        """
        if not self._claimed:
            return
        command = self._command
        try:
            self._sent = self._gripper.command_width(command.value)
        except GripperError as error:
            command.value, command.problem = self._sent, error
            self.problems.append(error)

    def prepare_command_mode_switch(
        self, start: Sequence[str], stop: Sequence[str]
    ) -> Sequence[str]:
        """Check the names; the servo has one mode."""
        self.require_commands((*start, *stop))
        unclaimed = () if self._claimed else stop
        return [f"{name} is released, but was not claimed" for name in unclaimed]

    def perform_command_mode_switch(self, start: Sequence[str], stop: Sequence[str]) -> None:
        """Claim or release the width; the command becomes the width commanded last."""
        self.require_commands((*start, *stop))
        self._claimed = bool(start) or (self._claimed and not stop)
        self._command.value = self._sent

    def _publish(self, velocity: float) -> None:
        stamp = self._clock.now()
        self._position.value, self._velocity.value = self._sent, velocity
        for state in (self._position, self._velocity):
            state.quality, state.stamp = Quality.ASSUMED, stamp
