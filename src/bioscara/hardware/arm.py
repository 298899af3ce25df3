"""The joints of the arm as one hardware component."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence

from bioscara.bus import Bus
from bioscara.clock import Clock
from bioscara.drivers import Joint, read_states, track
from bioscara.drivers.cycle import Outcome
from bioscara.errors import (
    BioscaraError,
    HardwareError,
    JointError,
    JointLostError,
    ModeSwitchError,
)
from bioscara.hardware.axis import Axis
from bioscara.hardware.component import HardwareComponent
from bioscara.hardware.lifecycle import State
from bioscara.hardware.modes import MOTION, Mode, resolve
from bioscara.hardware.stopping import stop_and_disable
from bioscara.model import JointParameters
from bioscara.protocol import Flags

_HALTED = int(Flags.STALL | Flags.NOTENABLED | Flags.FAULT)
"""Flags of a joint that does not follow its commands."""


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
                if not axis.joint.is_enabled():
                    axis.joint.enable()
                axis.halted, axis.mode = None, Mode.NONE
            self._ask(self.axes)
            for axis in self.axes:
                if axis.halted is not None:
                    raise axis.halted
                axis.publish()
                axis.rest_here()
        except BaseException:
            stop_and_disable(self.joints)
            raise

    def on_deactivate(self) -> None:
        """Stop and release every joint."""
        problems = stop_and_disable(self.joints)
        for axis in self.axes:
            axis.mode, axis.homing.running = Mode.NONE, False
        if problems:
            raise HardwareError("; ".join(problems), self.name)

    def on_cleanup(self) -> None:
        """Let every joint go; nothing is sent."""
        for axis in self.axes:
            axis.joint.deinit()
            axis.forget()

    def on_shutdown(self, before: State) -> None:
        """Release and let go."""
        self.on_error(before)

    def on_error(self, before: State) -> None:
        """Release and let go, from wherever it was."""
        try:
            if before is State.ACTIVE:
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
        self.problems.clear()
        self.bus_time = 0.0
        asked = [axis for axis in self.axes if not axis.answered and not _gone(axis)]
        if asked:
            self._ask(asked)
        for axis in self.axes:
            axis.answered = False
            axis.publish()
        self._require_some()

    def write(self, time: float, period: float) -> None:
        """Send what is claimed: one bus call for all joints that follow positions."""
        before = self._clock.now()
        following, velocities = [], []
        for axis in self.axes:
            mode = axis.mode
            if axis.halted is not None or mode is Mode.NONE:
                continue
            if mode is Mode.HOME:
                self._home(axis)
            elif mode is Mode.VELOCITY:
                velocities.append(axis)
            elif axis.position_command.value == axis.position_command.value:
                following.append(axis)
        if following:
            self._follow(following, time, period)
        for axis in velocities:
            self._drive(axis)
        self.bus_time += self._clock.now() - before

    def prepare_command_mode_switch(self, start: Sequence[str], stop: Sequence[str]) -> None:
        """Check that every joint can take its new mode now.

        Raises:
            ModeSwitchError: One cannot; the message says which, why and what to do.
        """
        for axis, mode in self._plan(start, stop):
            if axis.mode is Mode.HOME and axis.homing.running:
                raise ModeSwitchError(
                    f"{axis.name} is homing: command 0 to {axis.home_command.name} first",
                    self.name,
                )
            if mode is Mode.NONE:
                continue
            if axis.halted is not None:
                raise ModeSwitchError(f"{axis.name} cannot be commanded: {axis.halted}", self.name)
            if mode in MOTION and not axis.homed:
                raise ModeSwitchError(
                    f"{axis.name} is not homed: its position is unknown; home it first", self.name
                )
            if mode is Mode.TRACK and axis.joint.version < 2:
                raise ModeSwitchError(
                    f"{axis.name} cannot take position and velocity together: that needs joint "
                    "firmware of protocol 2; claim position alone",
                    self.name,
                )

    def perform_command_mode_switch(self, start: Sequence[str], stop: Sequence[str]) -> None:
        """Change the modes; a joint that nobody commands any more ramps down."""
        for axis, mode in self._plan(start, stop):
            before, axis.mode = axis.mode, mode
            if mode not in MOTION:
                if axis.halted is None:
                    if before in MOTION:
                        axis.joint.stop()
                    elif axis.homing.running:
                        axis.homing.stop()
                axis.home_command.value = 0.0
            elif before not in MOTION:
                axis.rest_here()

    def _plan(self, start: Sequence[str], stop: Sequence[str]) -> list[tuple[Axis, Mode]]:
        for name in (*start, *stop):
            if name not in self.commands:
                near = difflib.get_close_matches(name, self.commands, 1)
                raise ModeSwitchError(
                    f"{self.name} has no command interface {name}; "
                    + (
                        f"did you mean {near[0]}?" if near else "it has " + ", ".join(self.commands)
                    ),
                    self.name,
                )
        plan = []
        for axis in self.axes:
            kinds = set(axis.mode.value)
            kinds -= {self.commands[name].kind for name in stop if name.startswith(f"{axis.name}/")}
            kinds |= {
                self.commands[name].kind for name in start if name.startswith(f"{axis.name}/")
            }
            mode = resolve(self.name, axis.name, kinds)
            if mode is not axis.mode:
                plan.append((axis, mode))
        return plan

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
                self._halt(axis, outcome)
                continue
            axis.take(outcome, stamp)
            axis.answered = answered
            if answered:
                axis.arrival = stamp - time
            if outcome.flags & _HALTED and axis.halted is None and axis.mode in MOTION:
                self._halt(axis, self._reason(axis))

    def _reason(self, axis: Axis) -> BioscaraError:
        """Return why a joint that answers does not move."""
        try:
            if axis.joint.version == 2 and axis.joint.session.flags & Flags.FAULT:
                axis.joint.raise_fault()
            axis.joint.require_ready()
        except BioscaraError as error:
            return error
        return JointError(f"{axis.name}: the joint stopped and did not say why", axis.name)

    def _halt(self, axis: Axis, reason: BioscaraError) -> None:
        if axis.halted is not None:
            return
        axis.halted = reason
        self.problems.append(reason)
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
                self._require_rest(axis)
                homing.start(command.value)
        except BioscaraError as error:
            # With a command of 0 it is told to stop, cycle by cycle, until it heard.
            command.value, command.problem = 0.0, error
            self.problems.append(error)

    def _require_rest(self, axis: Axis) -> None:
        """Engaging a joint keeps the bus for some time, in which no other may need it."""
        for other in self.axes:
            if other is not axis and (other.homing.running or other.mode in MOTION):
                doing = "homing" if other.homing.running else "under command"
                raise ModeSwitchError(
                    f"{axis.name} cannot start homing while {other.name} is {doing}", self.name
                )

    def _drive(self, axis: Axis) -> None:
        try:
            axis.joint.set_velocity(axis.velocity_command.value)
        except BioscaraError as error:
            self._halt(axis, error)

    def _require_some(self) -> None:
        """Raise if no joint can be reached at all."""
        if all(_gone(axis) for axis in self.axes):
            raise HardwareError(
                f"{self.name}: no joint can be reached; first: {self.axes[0].halted}", self.name
            )


def _gone(axis: Axis) -> bool:
    return isinstance(axis.halted, JointLostError) or axis.joint.session.version == 0
