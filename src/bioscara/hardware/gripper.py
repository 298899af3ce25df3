"""The gripper as a hardware component."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from bioscara.clock import Clock
from bioscara.drivers import Gripper, Pwm, Quality
from bioscara.drivers.gripper.pwm import SYSFS
from bioscara.errors import GripperError
from bioscara.hardware.component import HardwareComponent
from bioscara.hardware.interfaces import POSITION, VELOCITY, CommandInterface, StateInterface
from bioscara.hardware.lifecycle import State
from bioscara.hardware.ros2_control_tags import read_gripper
from bioscara.hardware.urdf_reader import Urdf
from bioscara.model import GripperParameters, JointParameters
from bioscara.model.tags import GRIPPER_COMPONENT


class GripperHardware(HardwareComponent):
    """A servo that is told a width and never answers.

    What it publishes is what the servo was told, of quality ASSUMED while it is driven and
    UNKNOWN otherwise: then the jaws may be moved by hand.

    Args:
        name: Name of the component.
        joint: Name of its joint.
        gripper: The driver.
        clock: What measurements are stamped by.
    """

    def __init__(self, name: str, joint: str, gripper: Gripper, clock: Clock) -> None:
        super().__init__(name, "actuator")
        self._gripper, self._clock = gripper, clock
        self._position = StateInterface(joint, POSITION)
        self._velocity = StateInterface(joint, VELOCITY)
        self._command = CommandInterface(joint, POSITION)
        self._told = self._before = gripper.state.width
        self._claimed = False
        self.states = {state.name: state for state in (self._position, self._velocity)}
        self.commands = {self._command.name: self._command}

    @classmethod
    def from_description(
        cls,
        urdf: Urdf,
        servo: GripperParameters,
        clock: Clock,
        state_file: Path,
        *,
        name: str = GRIPPER_COMPONENT,
        root: Path = SYSFS,
    ) -> GripperHardware:
        """Return the gripper that a description tells of; nothing is written yet.

        Args:
            urdf: The description.
            servo: Where pulses and wiring are taken from.
            clock: Time to wait and to stamp by.
            state_file: Where the last width is kept.
            name: Name of the ``<ros2_control>`` tag.
            root: The kernel's folder of PWM outputs.

        Raises:
            ConfigurationError: The description cannot be used.
        """
        said = read_gripper(urdf, servo, name)
        pwm = Pwm(said.parameters.outputs, clock, root)
        return cls(said.name, said.joint, Gripper(pwm, said.parameters, state_file), clock)

    @property
    def limits(self) -> Mapping[str, JointParameters]:
        """None: the driver bounds the width."""
        return {}

    def on_configure(self) -> None:
        """Look whether there is an output; nothing is written."""
        self._gripper.check()

    def on_activate(self) -> None:
        """Drive the servo to where it is; the command becomes that width."""
        self._gripper.enable()
        self._told = self._before = self._command.value = self._gripper.state.width
        self._publish(0.0)

    def on_deactivate(self) -> None:
        """Keep the width and let the servo go."""
        self._claimed = False
        self._gripper.disable()
        self._forget()

    def on_cleanup(self) -> None:
        """Nothing is held."""

    def on_shutdown(self, before: State) -> None:
        """Keep the width and let the servo go."""
        self._claimed = False
        self._gripper.disable()

    def on_error(self, before: State) -> None:
        """Let the servo go; its width is not kept, since a cycle may end here.

        The error that led here is known already; a servo that is driven on is found to be when it
        is activated again.
        """
        self._claimed = False
        with suppress(GripperError):
            self._gripper.disable(keep=False)

    def keep(self, width: float | None = None) -> None:
        """Keep a width for after a loss of power; waits for the disk, so never within a cycle.

        Args:
            width: What will be commanded [m]; None for what the servo was told last.

        Raises:
            GripperError: The state file cannot be written; nothing moved.
        """
        self._gripper.keep(width)

    def read(self, time: float, period: float) -> None:
        """Publish what the servo was told, and how fast that changed over the last period."""
        self.problems.clear()
        if self.state is State.ACTIVE:
            self._publish((self._told - self._before) / period if period > 0.0 else 0.0)
            self._before = self._told

    def write(self, time: float, period: float) -> None:
        """Tell the servo a new width; the one that it was told already costs nothing.

        A width that cannot be told is given up, and what the jaws hold stays held: the command
        becomes the width of before and has a problem. Nothing is kept here: see :meth:`keep`.
        """
        if not self._claimed:
            return
        command = self._command
        try:
            self._told = self._gripper.tell_width(command.value)
        except GripperError as error:
            command.value, command.problem = self._told, error
            self.problems.append(error)

    def prepare_command_mode_switch(
        self, start: Sequence[str], stop: Sequence[str]
    ) -> Sequence[str]:
        """Check the names; the servo has one mode."""
        self.require_commands((*start, *stop))
        unclaimed = () if self._claimed else stop
        return [f"{name} is let go, but nobody had claimed it" for name in unclaimed]

    def perform_command_mode_switch(self, start: Sequence[str], stop: Sequence[str]) -> None:
        """Claim or let go of the width; the command becomes the width that was told last."""
        self.require_commands((*start, *stop))
        self._claimed = bool(start) or (self._claimed and not stop)
        self._command.value = self._told

    def _publish(self, velocity: float) -> None:
        stamp = self._clock.now()
        self._position.value, self._velocity.value = self._told, velocity
        for state in (self._position, self._velocity):
            state.quality, state.stamp = Quality.ASSUMED, stamp
