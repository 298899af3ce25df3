"""The joints of the arm as one hardware component."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress

from bioscara.bus import Bus
from bioscara.clock import Clock
from bioscara.drivers import Joint, JointSample, drive, read_states, track
from bioscara.drivers.cycle import Outcome
from bioscara.errors import BioscaraError, HardwareError, JointError
from bioscara.hardware.axis import HALTED, Axis
from bioscara.hardware.capacity import Capacity
from bioscara.hardware.component import HardwareComponent
from bioscara.hardware.description import read_arm
from bioscara.hardware.lifecycle import State
from bioscara.hardware.modes import MOTION, Mode
from bioscara.hardware.stopping import stop_and_disable
from bioscara.hardware.switching import (
    check_capacity,
    check_homing,
    check_modes,
    doubts,
    plan_modes,
)
from bioscara.hardware.urdf_reader import Urdf
from bioscara.model import JointParameters
from bioscara.model.tags import ARM_COMPONENT
from bioscara.protocol import Flags


class ArmHardware(HardwareComponent):
    """All joints of one bus.

    A joint that fails alone is left out and told of in ``problems``: the others must still be
    brought to rest together. Only when no joint can be reached does ``read`` or ``write`` raise.

    Args:
        name: Name of the component.
        bus: What the joints are on; not closed here.
        clock: Time of that bus.
        joints: What the joints are.

    Attributes:
        axes: The joints with their handles.
        bus_time: How long the exchanges of the last cycle took [s].
        capacity: What its bus can carry; None where nothing is refused for that.
    """

    def __init__(
        self, name: str, bus: Bus, clock: Clock, joints: Sequence[JointParameters]
    ) -> None:
        super().__init__(name)
        self._clock = clock
        self.axes = tuple(Axis(Joint(bus, clock, joint), clock) for joint in joints)
        self._limits = {joint.name: joint for joint in joints}
        for axis in self.axes:
            for state in (axis.position, axis.velocity, axis.home):
                self.states[state.name] = state
            for command in (axis.position_command, axis.velocity_command, axis.home_command):
                self.commands[command.name] = command
        self.bus_time = 0.0
        self.capacity: Capacity | None = None
        self._engaged = False
        self._late: list[BioscaraError] = []

    @classmethod
    def from_description(
        cls, urdf: Urdf, bus: Bus, clock: Clock, name: str = ARM_COMPONENT
    ) -> ArmHardware:
        """Return the arm that a description tells of; nothing is sent yet.

        Args:
            urdf: The description.
            bus: What the joints are on.
            clock: Time of that bus.
            name: Name of the ``<ros2_control>`` tag.

        Raises:
            ConfigurationError: The description cannot be used.
        """
        return cls(name, bus, clock, read_arm(urdf, name).joints)

    @property
    def limits(self) -> Mapping[str, JointParameters]:
        """Limits of its joints, by joint name."""
        return self._limits

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The drivers of its joints."""
        return tuple(axis.joint for axis in self.axes)

    def on_configure(self) -> None:
        """Greet every joint; if one does not answer, all are let go."""
        self._late.clear()
        try:
            for axis in self.axes:
                axis.joint.init()
                axis.halted, axis.mode = None, Mode.NONE
        except BaseException:
            self.on_cleanup()
            raise

    def on_activate(self) -> None:
        """Engage every joint where it stands; if one does not, all are released."""
        try:
            for axis in self.axes:
                axis.joint.enable()
                axis.halted, axis.mode = None, Mode.NONE
            self._engaged = True
            self._ask(self.axes)
            for axis in self.axes:
                if axis.halted is not None:
                    raise axis.halted
                axis.publish()
                axis.rest_here()
        except BaseException:
            self._engaged = False
            stop_and_disable(self.joints)
            raise

    def on_deactivate(self) -> None:
        """Stop and release every joint."""
        self._engaged = False
        problems = stop_and_disable(self.joints)
        self._end_modes()
        if problems:
            raise HardwareError("; ".join(problems), self.name)

    def on_cleanup(self) -> None:
        """Let every joint go; nothing is sent."""
        for axis in self.axes:
            axis.joint.deinit()
            axis.forget()

    def on_shutdown(self, before: State) -> None:
        """Release and let go."""
        try:
            if before is State.ACTIVE:
                self.on_deactivate()
        finally:
            self.on_cleanup()

    def on_error(self, before: State) -> None:
        """Release and let go, from wherever it was.

        A joint that cannot be told stops by itself and is greeted anew before it moves again, so
        the component can be configured again. The error that led here is known already.
        """
        try:
            if before is State.ACTIVE:
                with suppress(HardwareError):
                    self.on_deactivate()
        finally:
            self.on_cleanup()

    def clear_faults(self) -> list[str]:
        """Acknowledge what the joints latched; they stay disabled and nothing moves.

        Returns:
            A sentence for each.

        Raises:
            CommunicationError: A joint does not answer.
        """
        cleared = []
        for joint in self.joints:
            if joint.version == 2 and joint.get_flags() & Flags.FAULT:
                report = joint.get_fault()
                joint.clear_fault(report.fault)
                cleared.append(f"{joint.name}: cleared {report.fault} ({report.data:g}) of before")
        return cleared

    def read(self, time: float, period: float) -> None:
        """Measure every joint that did not already say where it is when it was written to."""
        self.problems[:], self._late[:] = self._late, ()
        self.bus_time = 0.0
        asked = [axis for axis in self.axes if not axis.answered and not axis.gone]
        if asked:
            self._ask(asked)
        for axis in self.axes:
            axis.answered = False
            axis.publish()
        if all(axis.gone for axis in self.axes):
            raise HardwareError(
                f"{self.name}: no joint can be reached; first: {self.axes[0].halted}", self.name
            )

    def write(self, time: float, period: float) -> None:
        """Send what is claimed: one bus call for all positions, one for all velocities."""
        before = self._clock.now()
        following, driven = [], []
        for axis in self.axes:
            mode = axis.mode
            if axis.halted is not None or mode is Mode.NONE:
                continue
            if mode is Mode.HOME:
                self._home(axis)
            elif mode is Mode.VELOCITY:
                driven.append(axis)
            elif axis.position_command.value == axis.position_command.value:
                following.append(axis)
        if following:
            self._follow(following, time, period)
        if driven:
            self._drive(driven)
        self.bus_time += self._clock.now() - before

    def prepare_command_mode_switch(
        self, start: Sequence[str], stop: Sequence[str]
    ) -> Sequence[str]:
        """Check that every joint can take its new mode now, and the bus the cycles of all.

        Returns:
            What is odd about letting interfaces go, but no reason to refuse it.

        Raises:
            ModeSwitchError: One cannot; the message says which, why and what to do.
        """
        self.require_commands((*start, *stop))
        plan = plan_modes(self.name, self.axes, start, stop)
        check_modes(self.name, self.axes, plan)
        if self.capacity is not None:
            check_capacity(self.name, self.axes, plan, self.capacity)
        return doubts(self.axes, stop, plan)

    def perform_command_mode_switch(self, start: Sequence[str], stop: Sequence[str]) -> None:
        """Change the modes; a joint that nobody commands any more ramps down.

        One that cannot be told to is a problem of the next cycle: it hears no more setpoints, so
        it stops by itself.
        """
        self.require_commands((*start, *stop))
        for axis, mode in plan_modes(self.name, self.axes, start, stop):
            leaving = axis.homing.running or (axis.mode in MOTION and mode not in MOTION)
            axis.change(mode)
            if leaving and axis.halted is None:
                try:
                    axis.joint.stop()
                    axis.homing.running = False
                except BioscaraError as error:
                    self._halt(axis, error, self._late)

    def _end_modes(self) -> None:
        for axis in self.axes:
            axis.mode, axis.homing.running = Mode.NONE, False
            # What it answered last is not what it will be found to be when it is read again.
            axis.answered = False

    def _ask(self, axes: Sequence[Axis]) -> None:
        start = self._clock.now()
        outcomes = read_states([axis.joint for axis in axes], retry=True)
        self._take(axes, outcomes, start, start, answered=False)
        self.bus_time += self._clock.now() - start

    def _follow(self, axes: Sequence[Axis], time: float, period: float) -> None:
        start = self._clock.now()
        outcomes = track(
            [axis.joint for axis in axes], [axis.setpoint(period) for axis in axes], retry=True
        )
        self._take(axes, outcomes, start, time, answered=True)

    def _drive(self, axes: Sequence[Axis]) -> None:
        velocities = [axis.velocity_command.value for axis in axes]
        outcomes = drive([axis.joint for axis in axes], velocities, retry=True)
        for axis, outcome in zip(axes, outcomes, strict=True):
            if isinstance(outcome, BioscaraError):
                self._halt(axis, outcome, self.problems)
            else:
                self._notice(axis, outcome)

    def _take(
        self,
        axes: Sequence[Axis],
        outcomes: Sequence[Outcome],
        start: float,
        time: float,
        *,
        answered: bool,
    ) -> None:
        # One bus call carries all frames, one after the other and all of the same length.
        share = (self._clock.now() - start) / len(axes)
        stamp = start
        for axis, outcome in zip(axes, outcomes, strict=True):
            stamp += share
            if isinstance(outcome, BioscaraError):
                self._halt(axis, outcome, self.problems)
                continue
            axis.take(outcome, stamp)
            axis.answered = answered
            if answered:
                axis.arrival = stamp - time
            self._notice(axis, outcome)

    def _notice(self, axis: Axis, sample: JointSample) -> None:
        """Take a joint out that does not follow; one that is to home is engaged by that."""
        if not sample.flags & HALTED or axis.halted is not None or axis.mode is Mode.HOME:
            return
        if self._engaged:
            self._halt(axis, axis.why_halted(), self.problems)

    def _halt(self, axis: Axis, reason: BioscaraError, problems: list[BioscaraError]) -> None:
        if axis.halted is not None:
            return
        axis.halted = reason
        problems.append(reason)
        axis.homing.running = False
        if axis.mode is Mode.HOME:
            axis.home_command.value, axis.home_command.problem = 0.0, reason
        if not isinstance(reason, JointError) or not axis.joint.session.version:
            axis.forget()

    def _home(self, axis: Axis) -> None:
        command, homing = axis.home_command, axis.homing
        try:
            if homing.running:
                if command.value == 0.0:
                    homing.stop()
                elif not homing.watch():
                    command.value = 0.0
            elif command.value:
                check_homing(self.name, self.axes, axis)
                homing.start(command.value)
        except BioscaraError as error:
            # With a command of 0 it is told to stop, cycle by cycle, until it heard.
            command.value, command.problem = 0.0, error
            self.problems.append(error)
