"""The joints of the arm as one hardware component."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import isnan

from bioscara.bus import Bus
from bioscara.clock import Clock, Waits, wait_through
from bioscara.drivers import Joint, await_power_up
from bioscara.errors import (
    BioscaraError,
    BusStuckError,
    HardwareError,
    HomingError,
    NoAcknowledgeError,
)
from bioscara.hardware.axis import HALTED, Axis
from bioscara.hardware.bus_budget import Capacity, load_reporters
from bioscara.hardware.bus_watch import BusWatch
from bioscara.hardware.command_modes import MOTION, Mode
from bioscara.hardware.component import HardwareComponent, LifecycleState
from bioscara.hardware.cyclic_io import ArmExchange
from bioscara.hardware.mode_switching import (
    check_capacity,
    check_homing,
    check_modes,
    plan_modes,
    release_warnings,
)
from bioscara.hardware.safe_stop import stop_and_disable
from bioscara.model import JointParameters
from bioscara.protocol import SILENCE, Flags

_log = logging.getLogger(__name__)
# A member of an enumeration takes longer to look up than all else that a cycle does with it.
_NONE, _VELOCITY, _HOME = Mode.NONE, Mode.VELOCITY, Mode.HOME

_CLEARING = 3e-3
"""Time after which a joint has cleared its fault or keeps it [s]: its control tick is 1 ms."""


class ArmHardware(HardwareComponent):
    """All joints of one bus.

    A joint that fails alone is left out and reported in ``problems``: the others must still be
    brought to rest together. Only when no joint can be reached does ``read`` or ``write`` raise. A
    stuck bus is one problem of all joints: none is asked any more until they are identified again.

    Args:
        name: Name of the component.
        bus: Bus of the joints; not closed here.
        clock: Time of that bus.
        joints: Parameters of the joints.

    Attributes:
        axes: The joints with their handles.
        capacity: Capacity of its bus; None if no mode is refused because of it.
        freed_by: Joints whose restart freed a stuck bus before it was configured, if that is known.
    """

    def __init__(
        self, name: str, bus: Bus, clock: Clock, joints: Sequence[JointParameters]
    ) -> None:
        super().__init__(name)
        self._bus, self._clock = bus, clock
        self.axes = tuple(Axis(Joint(bus, clock, joint), clock) for joint in joints)
        self._limits = {joint.name: joint for joint in joints}
        for axis in self.axes:
            for state in (axis.position, axis.velocity, axis.home):
                self.states[state.name] = state
            for command in (axis.position_command, axis.velocity_command, axis.home_command):
                self.commands[command.name] = command
        self._watch = BusWatch(bus, clock, self.axes)
        self._exchange = ArmExchange(clock, self.axes, self._watch, self.problems)
        self.capacity: Capacity | None = None
        self.freed_by: tuple[str, ...] = ()
        self._late: list[BioscaraError] = []
        self._written = -math.inf

    @property
    def limits(self) -> Mapping[str, JointParameters]:
        """Limits of its joints, by joint name."""
        return self._limits

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The drivers of its joints."""
        return tuple(axis.joint for axis in self.axes)

    def on_configure(self) -> None:
        """Identify every joint; if one does not answer, all are released.

        If one does not even acknowledge, the arm may have been switched on just now: then nothing
        is sent for a second first, and a warning is logged.
        """
        self._late.clear()
        self.freed_by = ()
        for axis in self.axes:
            axis.halted, axis.mode = None, Mode.NONE
        try:
            await_power_up(
                self._bus,
                self._clock,
                {axis.name: axis.joint.parameters.address for axis in self.axes},
                _log.warning,
            )
            for axis in self.axes:
                axis.joint.init()
        except BioscaraError as error:
            cause = self._why_not_configured(error)
            self.on_cleanup()
            if cause is error:
                raise
            raise cause from error
        except BaseException:
            self.on_cleanup()
            raise
        if self._exchange.stuck is not None:
            self._exchange.stuck = None
            self.freed_by = tuple(self._watch.restarted())

    def on_activate(self) -> None:
        """Enable every joint at its present position; if one fails, all are released."""
        wait_through(self._clock, self._enabling())

    def activating(self) -> Waits:
        """Run :meth:`activate` up to each of its waits, between which it can be read.

        The errors are those of :meth:`activate`.
        """
        self._require("activate", LifecycleState.INACTIVE)
        try:
            yield from self._enabling()
        except BaseException:
            self._forget()
            raise
        self._enter(LifecycleState.ACTIVE)

    def _enabling(self) -> Waits:
        try:
            for axis in self.axes:
                try:
                    yield from axis.joint.enabling()
                except BioscaraError as error:
                    raise self._cause(axis, error) from error
                axis.halted, axis.mode = None, Mode.NONE
            self._exchange.enabled = True
            self._exchange.request_states(self.axes)
            for axis in self.axes:
                if axis.halted is not None:
                    raise axis.halted
                axis.publish()
                axis.rest_here()
        except BaseException:
            self._exchange.enabled = False
            stop_and_disable(self.joints)
            raise

    def on_deactivate(self) -> None:
        """Stop and disable every joint."""
        self._exchange.enabled = False
        try:
            self.disable()
        finally:
            self._end_modes()

    def deactivating(self) -> Waits:
        """Run :meth:`deactivate` up to each of its waits, between which it can be read.

        If something fails or ends it early, :meth:`deactivate` does all of it again, without
        waits. It may be taken down meanwhile, after a fault.
        """
        self._require("deactivate", LifecycleState.ACTIVE)
        self._exchange.enabled = False
        try:
            for joint in self.joints:
                joint.stop()
            for joint in self.joints:
                yield from joint.disabling()
            self._end_modes()
        except BaseException as error:
            if self.state is LifecycleState.ACTIVE:
                self.deactivate()
            if not isinstance(error, BioscaraError):
                raise
        if self.state is LifecycleState.ACTIVE:
            self._enter(LifecycleState.INACTIVE)

    def on_cleanup(self) -> None:
        """Deinitialise every joint; nothing is sent."""
        for axis in self.axes:
            axis.joint.deinit()
            axis.forget()

    def on_shutdown(self, before: LifecycleState) -> None:
        """Release and deinitialise every joint."""
        try:
            if before is LifecycleState.ACTIVE:
                self.on_deactivate()
        finally:
            self.on_cleanup()

    def on_error(self, before: LifecycleState) -> None:
        """Release and deinitialise every joint, in any state.

        A joint that cannot be reached stops autonomously and is identified again before it moves,
        so the component can be configured again. The error that led here is already known.
        """
        try:
            if before is LifecycleState.ACTIVE:
                with suppress(HardwareError):
                    self.on_deactivate()
        finally:
            self.on_cleanup()

    def disable(self) -> None:
        """Stop and disable every joint, in any state of the component and despite any failure.

        Raises:
            HardwareError: Some may still be energised; names them.
        """
        problems = stop_and_disable(self.joints)
        if problems and (stuck := self._watch.stuck(lost=True)):
            names = ", ".join(axis.name for axis in self.axes)
            raise HardwareError(f"{names} may be moving or energised: {stuck}", self.name)
        if problems:
            raise HardwareError("; ".join(problems), self.name)

    def latched(self, flags: Flags) -> list[BioscaraError]:
        """Return the errors of joints that stopped, restarted or fell silent while not supervised.

        Args:
            flags: The flags that report an autonomous stop.
        """
        found = []
        for axis in self.axes:
            try:
                if axis.joint.get_flags() & flags:
                    found.append(axis.why_halted())
            except BioscaraError as error:
                found.append(self._cause(axis, error))
                if self._exchange.stuck is not None:
                    break
        return found

    def clear_faults(self) -> None:
        """Clear the joints' latched faults; they stay disabled and nothing moves.

        Raises:
            CommunicationError: A joint does not answer.
            JointError: The cause of a joint's fault lasts, as a missing supply.
        """
        joints = [joint for joint in self.joints if joint.version == 2]
        for joint in joints:
            if joint.get_flags() & Flags.FAULT:
                joint.clear_fault(joint.get_fault().fault)
        self._clock.sleep_until(self._clock.now() + _CLEARING)
        for joint in joints:
            if joint.get_flags() & Flags.FAULT:
                joint.raise_fault()

    def read(self, time: float, period: float) -> None:
        """Read the state of every joint that did not report it in the last write."""
        self.problems[:], self._late[:] = self._late, ()
        self.bus_time = 0.0
        if self._exchange.stuck is not None:
            return
        # A joint that received nothing for so long may have stopped autonomously.
        old = time - self._written > min(2.0 * period, SILENCE)
        unanswered = [
            axis for axis in self.axes if (old or not axis.answered) and not axis.unreachable
        ]
        if unanswered:
            before = self._clock.now()
            self._exchange.request_states(unanswered)
            self.bus_time += self._clock.now() - before
        reachable = False
        for axis in self.axes:
            axis.answered = False
            axis.publish()
            reachable = reachable or not axis.unreachable
        if not reachable and self._exchange.stuck is None:
            raise HardwareError(
                f"{self.name}: no joint can be reached; first: {self.axes[0].halted}", self.name
            )

    def write(self, time: float, period: float) -> None:
        """Send the claimed commands: one bus call for all positions, one for all velocities."""
        before, self._written = self._clock.now(), time
        following, driven = [], []
        for axis in self.axes:
            mode, homing = axis.mode, axis.homing
            if axis.halted is not None:
                if homing.running:
                    homing.stop_lost()
            elif mode is _HOME or homing.running:
                self._home(axis)
            elif mode is _VELOCITY:
                driven.append(axis)
            elif mode is not _NONE and not isnan(axis.position_command.value):
                following.append(axis)
        if following:
            self._exchange.send_positions(following, time, period)
        if driven:
            self._exchange.send_velocities(driven)
        self.bus_time += self._clock.now() - before

    def prepare_command_mode_switch(
        self, start: Sequence[str], stop: Sequence[str]
    ) -> Sequence[str]:
        """Check that every joint can take its new mode now, and that the bus can carry the cycles.

        Returns:
            Warnings about releasing interfaces that are no reason to refuse it.

        Raises:
            ModeSwitchError: One cannot; the message names it, the reason and the remedy.
        """
        self.require_commands((*start, *stop))
        plan = plan_modes(self.name, self.axes, start, stop)
        check_modes(self.name, self.axes, plan)
        if self.capacity is not None:
            check_capacity(self.name, self.axes, plan, self.capacity)
        return release_warnings(self.axes, stop, plan)

    def perform_command_mode_switch(self, start: Sequence[str], stop: Sequence[str]) -> None:
        """Change the modes; a joint that is no longer commanded ramps down.

        A joint that does not receive the stop is a problem of the next cycle: it receives no more
        setpoints, so it stops autonomously. To one that was homing, the stop is repeated in every
        cycle until it is received.
        """
        self.require_commands((*start, *stop))
        for axis, mode in plan_modes(self.name, self.axes, start, stop):
            leaving = axis.homing.running or (axis.mode in MOTION and mode not in MOTION)
            failed = axis.home_command.problem
            if isinstance(failed, HomingError) and HALTED[axis.joint.session.flags]:
                # Already reported; while the joint was to home, that did not halt it.
                axis.halted = failed
            axis.change(mode)
            if leaving and axis.halted is None:
                try:
                    axis.joint.stop()
                    axis.homing.abandon()
                except BioscaraError as error:
                    cause = self._cause(axis, error)
                    if axis.homing.running or isinstance(cause, BusStuckError):
                        self._late.append(cause)
                    else:
                        axis.mark_missed(error)
                        if axis.halt(error):
                            self._late.append(cause)
        self._ask_loads()

    def _ask_loads(self) -> None:
        """Let the joints report their loads, in turns where the bus has no time for all of them."""
        if self.capacity is None:
            return
        modes = [(axis.joint, axis.mode) for axis in self.axes]
        joints, most = load_reporters(modes), self.capacity.loads(modes)
        turns = math.ceil(len(joints) / most) if most else 0
        for index, joint in enumerate(joints):
            joint.cycle.ask_load(turns, index % turns if turns else 0)

    def _end_modes(self) -> None:
        for axis in self.axes:
            axis.mode = Mode.NONE
            axis.homing.abandon()
            # Its last answer does not hold after the change of mode, so it is read again.
            axis.answered = False

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
            cause = self._cause(axis, error)
            # With a command of 0 the stop is sent in every cycle until it is received.
            command.value, command.problem = 0.0, cause
            self.problems.append(cause)

    def _why_not_configured(self, error: BioscaraError) -> BioscaraError:
        """Return why the joints cannot be identified, with the joints that held a line low."""
        cause = self._watch.cause(error)
        if self._exchange.stuck is None or not isinstance(cause, NoAcknowledgeError):
            return cause
        silent = self._watch.silent()
        if not silent:
            return cause
        one = len(silent) == 1
        return NoAcknowledgeError(
            f"{cause}; without {', '.join(silent)} the bus works again: "
            f"{'this joint' if one else 'one of these joints'} or its cable holds a line low; "
            "repair that, then connect it again",
            cause.address,
        )

    def _cause(self, axis: Axis, error: BioscaraError) -> BioscaraError:
        """Return the cause of a failed exchange with one joint; a stuck bus halts all."""
        cause = self._exchange.stuck or self._watch.cause(error, axis.name)
        if isinstance(cause, BusStuckError) and self._exchange.stuck is None:
            self._exchange.give_up(cause)
        return cause
