"""One joint, with all functions of the original driver, in SI joint units."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial

from bioscara.arguments import flag, number, shown, whole
from bioscara.bus import Bus
from bioscara.clock import Clock, Waits, wait_through
from bioscara.drivers.joint import capture
from bioscara.drivers.joint.cyclic import CyclicExchange
from bioscara.drivers.joint.feedback import EncoderFeedback
from bioscara.drivers.joint.homing import HomingProcedure
from bioscara.drivers.joint.limits import SetpointLimits, check_limit
from bioscara.drivers.joint.monitor import (
    Cancel,
    Done,
    MotionMonitor,
    Progress,
    check_callbacks,
    not_busy,
)
from bioscara.drivers.joint.readiness import Readiness
from bioscara.drivers.joint.rest import STOP_HARD, STOP_SOFT, Rest
from bioscara.drivers.joint.sample import FLAGS, JointSample, Setpoint
from bioscara.drivers.joint.settings import Settings
from bioscara.drivers.joint.transmission import DEG_PER_MICROSTEP
from bioscara.drivers.link.joint_reports import ExceptionReport, FaultReport, Hello
from bioscara.drivers.link.session import Session
from bioscara.errors import (
    BioscaraError,
    CommunicationError,
    HomingError,
    IncorrectStateError,
    InvalidArgumentError,
    JointError,
    JointFaultError,
    JointResetError,
    LimitError,
    MotionCancelledError,
    NotEnabledError,
    NotSupportedError,
    RefusedError,
    StalledError,
)
from bioscara.model import JointParameters
from bioscara.protocol import (
    WATCHDOG_MS,
    BrakeMode,
    Capability,
    Fault,
    Flags,
    Refusal,
    Register,
    Warnings,
)

_ORIENTATION_TIMEOUT = 5.0
"""Time limit of the orientation check [s]."""
_ORIENTATION_MAX_DEG = 10.0
_MOVE_MARGIN = 2.0
"""Time that a move may take beyond twice its expected duration [s]."""
_STEPS_MAX = 2**31 - 1


class Joint:
    """One joint on a bus, in rad or m and seconds; supports protocol versions 1 and 2.

    Life cycle of a joint: ``init``, ``enable``, ``home``, motion, ``disable``, ``deinit``. Nothing
    moves in ``init`` and ``deinit``. A function that a version 1 joint lacks raises
    :class:`~bioscara.errors.NotSupportedError`; every exchange may raise
    :class:`~bioscara.errors.CommunicationError` or :class:`~bioscara.errors.JointResetError`.

    Args:
        bus: Bus of the joint.
        clock: Time of that bus.
        parameters: Parameters of the joint.

    Attributes:
        bus: The bus.
        clock: The clock.
        parameters: The parameters.
        session: Its frames: protocol version, repetition, flags.
        feedback: Its measured state and homing offset.
        settings: Its currents, limits, stall detection and brake.
        limits: Checks of its setpoints.
        readiness: Preconditions of its motions.
        cycle: Its part of a control cycle, for :mod:`bioscara.drivers.joint.group`.
    """

    def __init__(self, bus: Bus, clock: Clock, parameters: JointParameters) -> None:
        self.bus, self.clock, self.parameters = bus, clock, parameters
        self.session = session = Session(
            bus, clock, parameters.name, parameters.number, parameters.address
        )
        self.feedback = EncoderFeedback(session, clock, parameters)
        self.readiness = Readiness(parameters.name, session, self.feedback)
        self._monitor = MotionMonitor(session, self.feedback, clock, parameters)
        self._rest = Rest(session, self.feedback, self.readiness, self._monitor, clock, parameters)
        self.settings = Settings(session, self._rest, clock, parameters)
        self.limits = SetpointLimits(parameters)
        self.cycle = CyclicExchange(session, self.feedback, self.readiness, parameters)
        self._homing = HomingProcedure(
            session, self.feedback, self._rest, self.settings, self.limits, parameters
        )

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} at {self.parameters.address:#04x}>"

    @property
    def name(self) -> str:
        """Name of the joint."""
        return self.parameters.name

    @property
    def firmware(self) -> str:
        """Protocol and firmware versions, in words."""
        if self.hello is None:
            return "protocol 1"
        major, minor = self.hello.firmware
        return f"protocol {self.hello.protocol}, firmware {major}.{minor}"

    @property
    def hello(self) -> Hello | None:
        """The joint's answer to HELLO; None for a version 1 joint or before ``init``."""
        return self.session.hello

    @property
    def version(self) -> int:
        """Version of the protocol that the joint speaks; 0 before ``init``."""
        return self.session.version

    @property
    def last(self) -> JointSample:
        """The newest sample; of quality UNKNOWN before there was one."""
        return self.feedback.last

    @property
    def may_be_energised(self) -> bool:
        """Whether the motor may have current, see :class:`Settings`; outlives the session."""
        return self.settings.may_be_energised

    # Identity and session.

    def init(self) -> None:
        """Identify the joint and open a session; a joint that is still homed stays homed.

        Nothing begins to move; a version 1 joint is stopped. May be called again at any time, and
        must be after a :class:`JointResetError`.

        Raises:
            CommunicationError: The joint does not answer.
            WrongJointError: Another joint answers.
            NotSupportedError: The joint speaks a newer protocol.
        """
        self.readiness.blocking = Register.NONE
        self.feedback.forget()
        self.session.open()
        self.cycle.renew()
        if not self.session.flags & Flags.NOTENABLED:
            self.settings.may_be_energised = True
        try:
            self._rest.begin()
            if not self.session.flags & Flags.NOTHOMED:
                self.feedback.adopt_offset()
        except BioscaraError:
            self.session.close()
            raise

    def deinit(self) -> None:
        """Release the joint; nothing is sent, so disable it first."""
        self.readiness.blocking = Register.NONE
        self.feedback.forget()
        self.session.close()

    def check_communication(self) -> None:
        """Check that the joint answers and is the one found by ``init``.

        Raises:
            CommunicationError: It does not answer.
            JointResetError: It restarted.
        """
        before = self.session.hello
        self.session.read(Register.PING)
        if before is None:
            return
        now = Hello.from_answer(self.session.read(Register.HELLO))
        if now.boot_id != before.boot_id:
            raise JointResetError(
                f"{self.name}: the joint restarted (reset cause {now.reset_cause.name})",
                self.name,
                "init(), enable() and home() it again",
                now.reset_cause.name,
            )

    def get_image(self) -> int:
        """Request the CRC-32 of the image that the joint runs; 0 for a simulated joint.

        Raises:
            NotSupportedError: A version 1 joint, or firmware without that register.
        """
        self._require(Capability.DIAGNOSIS, "get_image")
        return int(self.session.read(Register.IMAGE).values[0])

    def get_exception(self) -> ExceptionReport | None:
        """Request the processor's last exception since power came up; None if there was none.

        Raises:
            NotSupportedError: A version 1 joint, or firmware without that register.
        """
        self._require(Capability.DIAGNOSIS, "get_exception")
        return ExceptionReport.from_answer(self.session.read(Register.EXCEPTION))

    def get_warnings(self) -> Warnings:
        """Request the conditions of the joint that stop nothing and that a person should know.

        Raises:
            NotSupportedError: A version 1 joint, or firmware without that register.
        """
        self._require(Capability.DIAGNOSIS, "get_warnings")
        try:
            return Warnings(int(self.session.read(Register.WARNINGS).values[0]))
        except RefusedError as error:
            if error.reason != Refusal.UNKNOWN_REGISTER.name:
                raise
            raise self._unsupported("get_warnings") from error

    def start_bootloader(self) -> None:
        """Make the joint leave its firmware for the bootloader, to be flashed; home is lost.

        It stops answering until it is flashed or its power is cycled; then :meth:`init` it.

        Raises:
            NotInitializedError: ``init`` was not called.
            NotSupportedError: Its firmware has no such request.
            IncorrectStateError: It is enabled.
            CommunicationError: It did not answer, or refused the request.
        """
        try:
            self.session.start_bootloader()
        finally:
            if self.session.version == 0:
                self.deinit()

    # State.

    def get_flags(self) -> Flags:
        """Request the flags."""
        return FLAGS[self.session.read(Register.PING).flags]

    def is_homed(self) -> bool:
        """Request whether the joint knows its position, and its homing offset is known here."""
        return not self.get_flags() & Flags.NOTHOMED and self.feedback.offset_known

    def is_enabled(self) -> bool:
        """Request whether the motor is enabled."""
        return not self.get_flags() & Flags.NOTENABLED

    def is_stalled(self) -> bool:
        """Request whether the joint detected a stall."""
        return bool(self.get_flags() & Flags.STALL)

    def is_busy(self) -> bool:
        """Request whether a blocking command is running."""
        return bool(self.get_flags() & Flags.BUSY)

    def get_position(self) -> float:
        """Request the position [rad or m].

        Raises:
            NotHomedError: The joint does not know its position.
        """
        return self.feedback.read_position()

    def get_velocity(self) -> float:
        """Request the filtered velocity [rad/s or m/s]; it lags the motion by some 60 ms."""
        return self.feedback.read_velocity()

    def read_state(self) -> JointSample:
        """Request position, velocity, flags and, from a version 2 joint, state and load."""
        return self.feedback.read()

    def start_capture(self) -> None:
        """Begin to capture the position error, 256 times in 0.256 s; replaces the last capture.

        Raises:
            NotSupportedError: A version 1 joint, or firmware without captures.
        """
        self._require(Capability.DIAGNOSIS, "start_capture")
        self.session.write(Register.CAPTURE)

    def read_capture(self) -> capture.Capture:
        """Return the capture that :meth:`start_capture` began; waits until it is complete.

        It does not keep a motion alive: send setpoints until the motion ends, then call it.

        Raises:
            NotSupportedError: A version 1 joint, or firmware without captures.
            IncorrectStateError: No capture was begun since the joint started.
        """
        self._require(Capability.DIAGNOSIS, "read_capture")
        return capture.read(self.session, self.clock, self.name)

    # Faults.

    def get_fault(self) -> FaultReport:
        """Request the reason of the joint's last autonomous stop, and its counters.

        Raises:
            NotSupportedError: A version 1 joint does not report it.
        """
        self.session.require_v2("get_fault")
        return FaultReport.from_answer(self.session.read(Register.FAULT))

    def get_bus_errors(self) -> int:
        """Request the count of bus errors and abandoned transfers since the joint booted.

        Raises:
            NotSupportedError: A version 1 joint, or firmware without that counter.
        """
        self._require(Capability.BUS_ERRORS, "get_bus_errors")
        return int(self.session.read(Register.BUSERRORS).values[0])

    def clear_fault(self, fault: str | None = None) -> None:
        """Acknowledge the latched fault; the joint stays disabled and nothing moves.

        Args:
            fault: Name of the reported fault; None for any latched fault.

        Raises:
            NotSupportedError: A version 1 joint latches none; ``clear_stall`` clears its stall.
            RefusedError: Another fault is latched.
            InvalidArgumentError: No fault has that name.
        """
        self.session.require_v2("clear_fault")
        if fault is None:
            code = int(self.session.read(Register.FAULT).values[0])
        elif isinstance(fault, str) and fault in Fault.__members__:
            code = Fault[fault]
        else:
            raise InvalidArgumentError(
                f"{self.name}: {shown(fault)} is not a fault; known are "
                f"{', '.join(Fault.__members__)}"
            )
        self.session.write(Register.CLEARFAULT, code)

    def clear_stall(self) -> None:
        """Clear a stall that the joint detected, so that it accepts motions again; nothing moves.

        Remove the obstacle first. The joint is brought to rest, as its ramp runs on for up to half
        a second after the stall. It stays enabled if it was, and stall detection is on
        afterwards, in a version 1 joint with the configured threshold. A joint that did not stall
        is left as it is, also one with another latched fault.

        Raises:
            LimitError: A version 1 joint whose configured ``stall_threshold`` is 0, which cannot
                be switched on; ``enable`` clears its stall.
        """
        second = self.version == 2
        if not (self.get_fault().fault == Fault.STALL.name if second else self.is_stalled()):
            return
        wait_through(self.clock, self._rest.coming("the stall is cleared"))
        if second:
            self.clear_fault(Fault.STALL.name)
        else:
            # Original firmware does not execute CLEARSTALL.
            self.settings.restart_stallguard()

    def raise_fault(self) -> None:
        """Raise the latched fault, if the joint's last flags show one."""
        self.readiness.raise_fault()

    # Motor.

    def set_max_acceleration(self, acceleration: float) -> None:
        """Set the acceleration of the joint; as :meth:`Settings.set_max_acceleration`."""
        self.settings.set_max_acceleration(acceleration)

    def set_max_velocity(self, velocity: float) -> None:
        """Set the maximum speed of the joint; as :meth:`Settings.set_max_velocity`."""
        self.settings.set_max_velocity(velocity)

    def enable(self, drive_percent: int | None = None, hold_percent: int | None = None) -> None:
        """Enable the motor at its present position, with stall detection and the configured limits.

        Original firmware (version 1) turns and checks nothing here: it compares motor and encoder
        at power-up, and enables a motor that has no supply. A version 2 joint checks by a movement
        of at most 3 degrees of the motor that motor and encoder agree: the first time after it
        booted, after a reset of its driver, a fault of its encoder or of this check, and where
        friction held the rotor opposite to its field.

        Args:
            drive_percent: Motor current in motion; None for the configured one.
            hold_percent: Motor current at standstill; None for the configured one.

        Raises:
            LimitError: A current is not between 1 and 100 %.
            JointFaultError, StalledError: A fault is latched, or the check failed.
            NotEnabledError: The joint did not engage.
        """
        wait_through(self.clock, self.enabling(drive_percent, hold_percent))

    def enabling(self, drive_percent: int | None = None, hold_percent: int | None = None) -> Waits:
        """Run :meth:`enable` up to each of its waits; arguments and errors as there."""
        parameters, settings = self.parameters, self.settings
        drive, hold = parameters.drive_current_percent, parameters.hold_current_percent
        if drive_percent is not None:
            drive = whole(f"{self.name} drive current", drive_percent)
        if hold_percent is not None:
            hold = whole(f"{self.name} hold current", hold_percent)
        self.readiness.require_idle()
        for what, percent in (("drive", drive), ("hold", hold)):
            check_limit(
                f"{self.name} {what} current", percent, 1, 100, "%", "disable() switches it off"
            )
        settings.check_acceleration(parameters.max_acceleration)
        # Its first frame also shows whether the joint restarted, before it engages.
        yield from self._rest.coming("it is enabled")
        self.readiness.raise_fault()
        # If only the answer is lost, the motor is enabled.
        settings.may_be_energised = True
        self.session.write(Register.SETUP, drive, hold)
        yield from self._supervised(not_busy, _ORIENTATION_TIMEOUT, "enabling")
        if self.session.flags & Flags.NOTENABLED:
            self.raise_fault()
            raise NotEnabledError(f"{self.name}: the motor did not engage", self.name)
        if parameters.stall_threshold:
            settings.restart_stallguard()
        self._rest.set_acceleration(parameters.max_acceleration)
        settings.set_max_velocity(parameters.max_velocity)

    def disable(self) -> None:
        """Ramp down, wait for standstill and switch the motor's power off.

        Every step is tried, even if an earlier one failed.

        Raises:
            CommunicationError, JointError: The first error of these steps.
        """
        wait_through(self.clock, self.disabling())

    def disabling(self) -> Waits:
        """Run :meth:`disable` up to each of its waits; errors as there."""
        self.session.require_open()
        settings = self.settings
        waits_for_rest = partial(self._rest.coming, "it is released")
        steps: tuple[Callable[[], Waits | None], ...] = (
            self.stop,
            waits_for_rest,
            partial(settings.set_hold_current, 0),
            partial(settings.set_drive_current, 0),
            partial(settings.set_brake_mode, BrakeMode.FREEWHEEL),
        )
        if self.version == 2:
            # A version 2 joint removes the current once the rotor no longer oscillates.
            steps += (waits_for_rest,)
        problem: CommunicationError | JointError | None = None
        for step in steps:
            try:
                yield from step() or ()
            except (CommunicationError, JointError) as error:
                problem = problem or error
        if problem is not None:
            raise problem
        settings.may_be_energised = False

    def stop(self, *, hard: bool = False) -> None:
        """Ramp down and hold; ends a blocking command. Never refused because of the joint's state.

        A version 1 joint that has not yet taken a blocking command takes it first: the call then
        waits for up to 25 ms. An orientation check of such a joint is not ended but waited for,
        for up to 5 s: with its original firmware a STOP would leave it waiting for its target.

        Args:
            hard: True for the hardest deceleration instead of the configured one; original
                firmware (version 1) ignores it and takes the configured one.
        """
        if self.readiness.blocking is Register.HOME:
            # Must never prevent STOP.
            with suppress(CommunicationError, JointError):
                self._homing.restore_acceleration()
        self.readiness.blocking = Register.NONE
        flag(f"{self.name} hard", hard)
        self.session.stop(STOP_HARD if hard else STOP_SOFT)

    def keep_alive(self) -> Flags:
        """Feed the watchdog of a joint in an autonomous motion; return its flags."""
        if self.version == 2:
            return FLAGS[self.session.write(Register.WATCHDOG, WATCHDOG_MS).flags]
        return self.get_flags()

    # Homing.

    def home(
        self,
        velocity: float | None = None,
        sensitivity: int | None = None,
        current: int | None = None,
        *,
        progress: Progress | None = None,
        cancel: Cancel | None = None,
    ) -> None:
        """Seek the end stop and make it the joint's home; return when it is homed.

        The joint is enabled first if need be, and stays enabled. The first three arguments are in
        the original driver's order.

        Args:
            velocity: Least speed of the approach [rad/s or m/s]; its sign is the direction. None
                for the configured one. Our firmware approaches at 95 rpm of the motor (j2: 110)
                where that is faster.
            sensitivity: Position error that counts as a touch, 1 to 255 [microsteps of the motor];
                a smaller one is more sensitive. None for the configured one.
            current: Drive current while homing, 1 to 100 [%]; None for the configured one.
            progress: Called with each sample.
            cancel: Called without arguments after each sample before the end, which :attr:`last`
                has then; True aborts homing, the joint is then not homed.

        Raises:
            HomingError: No trustworthy home was found; states the reason.
            MotionCancelledError: ``cancel`` returned True.
        """
        check_callbacks(progress, cancel)
        self.start_homing(velocity, sensitivity, current)
        try:
            wait_through(
                self.clock,
                self._supervised(not_busy, self.homing_timeout, "homing", progress, cancel),
            )
        except (IncorrectStateError, JointFaultError, StalledError) as error:
            raise HomingError(f"{self.name}: homing failed: {error}", self.name) from error
        self.post_homing()

    @property
    def homing_timeout(self) -> float:
        """Time limit of the homing that was started last [s]."""
        return self._homing.timeout

    def start_homing(
        self,
        velocity: float | None = None,
        sensitivity: int | None = None,
        current: int | None = None,
    ) -> None:
        """Start homing and return; call :meth:`keep_alive` until it ends, then :meth:`post_homing`.

        Until then, a version 2 joint needs a write of WATCHDOG at least every 60 ms
        (``keep_alive``), our firmware in version 1 any exchange every 250 ms. Original firmware
        continues to the end stop whether it is polled or not; only :meth:`stop` ends that. It takes
        the command within 25 ms, during which nothing is sent to it.

        Args:
            velocity: As in :meth:`home`.
            sensitivity: Likewise.
            current: Likewise.

        Raises:
            HomingSpeedError: The motor speed is not between 1 and 250 rpm.
            InvalidArgumentError: The velocity is zero, or another value is not whole.
            LimitError: The velocity is faster than the joint, another value is outside its limits,
                or original firmware does not accept the configured homing acceleration.
            IncorrectStateError: A blocking command is running, or the joint did not come to rest.
        """
        waits = self.starting_homing(velocity, sensitivity=sensitivity, current=current)
        wait_through(self.clock, waits)

    def starting_homing(
        self,
        velocity: float | None = None,
        *,
        sensitivity: int | None = None,
        current: int | None = None,
    ) -> Waits:
        """Run :meth:`start_homing` up to each of its waits; arguments and errors as there."""
        homing, readiness = self._homing, self.readiness
        readiness.require_idle()
        approach = homing.check(velocity, sensitivity, current)
        yield from self._rest.coming("it is homed")
        if self.session.flags & (Flags.NOTENABLED | Flags.STALL):
            yield from self.enabling()
            yield from self._rest.coming("it is homed")
        homing.prepare(approach)
        readiness.blocking = Register.HOME
        try:
            homing.start()
        except BioscaraError:
            if self.version == 1:
                # If only the answer is lost it runs to the end stop, whether it is polled or not.
                with suppress(CommunicationError, JointError):
                    self.stop()
            readiness.blocking = Register.NONE
            raise

    def post_homing(self) -> None:
        """Complete a homing that has ended: set the joint's offset and restore its limits.

        Raises:
            HomingError: The joint is not homed; states the reason.
            NotInitializedError: ``init`` was not called.
            IncorrectStateError: No homing was started, or it is still running.
        """
        self.session.require_open()
        if self.readiness.blocking is not Register.HOME:
            raise IncorrectStateError(f"{self.name}: no homing was started", self.name)
        flags = self.get_flags()
        if flags & Flags.BUSY:
            raise IncorrectStateError(f"{self.name}: homing is still running", self.name)
        self.readiness.blocking = Register.NONE
        if flags & Flags.NOTHOMED:
            self._homing.restore_acceleration()
            raise self._homing_error()
        self._homing.complete()

    # Motion.

    def track(self, position: float, velocity: float = 0.0) -> JointSample:
        """Send the setpoint for one interval from now and return the present state.

        Args:
            position: Within the joint's limits [rad or m].
            velocity: Velocity at that position, within the joint's limits [rad/s or m/s].

        Raises:
            LimitError: Outside the limits; nothing was sent.
            NotEnabledError, NotHomedError, StalledError, JointFaultError: The joint cannot move.
            NotSupportedError: A version 1 joint has no TRACK; use ``set_position``.
            CommunicationError: The exchange failed three times.
        """
        self.session.require_v2("track")
        self.readiness.require_ready()
        setpoint = self.limits.check_setpoint(Setpoint(position, velocity))
        motor_setpoint = self.feedback.transmission.to_motor(setpoint)
        register = Register.TRACKLOAD if self.session.reports_load else Register.TRACK
        values, flags = self.session.write(register, *motor_setpoint)
        self.feedback.last = self.feedback.sample(values, flags, self.clock.now())
        return self.last

    def set_position(self, position: float) -> None:
        """Start a move to a position with the joint's own speed and acceleration limits.

        A version 2 joint stops when it receives no newer setpoint for 60 ms: repeat it until the
        joint arrives. Original firmware (version 1) continues to the position, even when the host
        dies.

        Args:
            position: Within the joint's limits [rad or m].

        Raises:
            LimitError: Outside the limits.
            NotEnabledError, NotHomedError, StalledError: The joint cannot move.
        """
        self.readiness.require_ready()
        position = self.limits.check_position(position)
        angle_deg = self.feedback.transmission.position_to_deg(position)
        self.session.write(Register.MOVETOANGLE, angle_deg)
        self.readiness.require_ready()

    def set_velocity(self, velocity: float) -> None:
        """Accelerate to a velocity and keep it for as long as it is repeated.

        Without a newer one a version 2 joint stops after 60 ms. Original firmware stops, and
        disables itself, 50 to 60 ms after the last exchange of any kind: polling alone keeps it
        moving.

        The joint does not know its position limits, so each call reads its position. Towards a
        limit, the joint must be able to stop before it if this setpoint were the last.

        Args:
            velocity: At most the configured velocity in either direction [rad/s or m/s].

        Raises:
            LimitError: Too fast, or the limit is too near; the joint was then stopped.
            NotEnabledError, NotHomedError, StalledError: The joint cannot move.
        """
        self.readiness.require_ready()
        velocity = self.limits.check_velocity(velocity)
        if velocity:
            self._stop_unless_clear(velocity)
        rpm = self.feedback.transmission.velocity_to_rpm(velocity)
        self.session.write(Register.SETRPM, rpm)
        self.readiness.require_ready()

    def move_steps(
        self, steps: int, progress: Progress | None = None, cancel: Cancel | None = None
    ) -> None:
        """Move by a number of microsteps of the motor (1/256 step) and wait for the end.

        Needs no home; with one, the end is checked against the limits. A version 1 frame is
        never repeated: if its answer is lost, it may have been executed. Original firmware
        continues to the target when the host dies; here its encoder decides whether it has arrived.

        Args:
            steps: Microsteps; their sign is the motor's, not the joint's.
            progress: Called with each sample.
            cancel: Called without arguments after each sample before the end, which :attr:`last`
                has then; True stops the joint.

        Raises:
            InvalidArgumentError: The number is not whole, or a function takes other arguments.
            LimitError: It would end outside the limits.
            IncorrectStateError: It did not arrive in twice the expected time.
            MotionCancelledError: ``cancel`` returned True.
        """
        feedback, settings = self.feedback, self.settings
        self.readiness.require_ready(homed=False)
        what = f"{self.name} steps"
        steps = whole(what, steps)
        check_callbacks(progress, cancel)
        check_limit(what, steps, -_STEPS_MAX, _STEPS_MAX, "microsteps")
        displacement = feedback.transmission.microsteps_to_displacement(steps)
        position = feedback.read().position
        if self.version == 1:
            # It would move although it stalled or was disabled since its last answer.
            self.readiness.require_ready(homed=False)
        if position is not None:
            self.limits.check_position(position + displacement)
        target_deg = feedback.encoder_deg + steps * DEG_PER_MICROSTEP
        duration = ramp_time(abs(displacement), settings.max_velocity, settings.max_acceleration)
        self.session.write(Register.MOVESTEPS, steps, repeat=False)
        arrived = self._monitor.arrived(target_deg, duration)
        wait_through(
            self.clock,
            self._supervised(arrived, 2.0 * duration + _MOVE_MARGIN, "the move", progress, cancel),
        )
        self.raise_fault()
        self.readiness.require_ready(homed=False)

    def check_orientation(self, motor_angle: float = math.radians(1.0)) -> None:
        """Turn the motor slightly and back, to check that motor and encoder agree.

        Our firmware turns by twice the angle, next to an end stop to the free side.

        Args:
            motor_angle: Angle by which the motor turns, at most 10 degrees [rad of the motor].

        Raises:
            LimitError: The angle is too large.
            JointFaultError: They do not agree (version 2; a version 1 joint corrects it).
            IncorrectStateError: It did not end within 5 s. Switch a version 1 joint off and on
                then: its check ends in no other way.
        """
        what = f"{self.name} orientation check angle"
        angle_deg = math.degrees(number(what, motor_angle))
        self.readiness.require_ready(homed=False)
        # The original driver took degrees.
        remedy = "it is given in rad: 10 degrees are 0.17453"
        check_limit(what, angle_deg, 0.0, _ORIENTATION_MAX_DEG, "deg", remedy)
        wait_through(self.clock, self._rest.coming("the check of its orientation"))
        self.readiness.require_ready(homed=False)
        self.readiness.blocking = Register.CHECKORIENTATION
        try:
            self.session.write(Register.CHECKORIENTATION, angle_deg, repeat=False)
            wait_through(
                self.clock,
                self._supervised(not_busy, _ORIENTATION_TIMEOUT, "the orientation check"),
            )
        except IncorrectStateError as error:
            if self.version == 1:
                error.remedy = "switch the joint off and on, which alone ends its check"
            raise
        finally:
            self.readiness.blocking = Register.NONE
        self.raise_fault()

    def _require(self, capability: Capability, what: str) -> None:
        self.session.require_v2(what)
        if self.hello is None or not self.hello.capabilities & capability:
            raise self._unsupported(what)

    def _unsupported(self, what: str) -> NotSupportedError:
        return NotSupportedError(
            f"{self.name}: its firmware has no {what}; flash firmware/joint of this host's version"
        )

    def _stop_unless_clear(self, velocity: float) -> None:
        """Stop the joint and raise if it could not stop within the limits from ``velocity``."""
        state = self.feedback.read()
        if state.position is None:
            self.raise_fault()
        elif state.flags & (Flags.STALL | Flags.NOTENABLED):
            return  # The refusal of the setpoint states the reason.
        try:
            self.limits.check_stopping(velocity, state, state.stamp, self.settings.max_acceleration)
        except LimitError:
            self.stop()
            raise

    def _supervised(
        self,
        done: Done,
        timeout: float,
        what: str,
        progress: Progress | None = None,
        cancel: Cancel | None = None,
    ) -> Waits:
        """Wait for the end of a motion, up to each wait; an exception also ends the motion."""
        try:
            yield from self._monitor.waits_for(done, timeout, what, progress, cancel)
        except BaseException as reason:
            with suppress(CommunicationError, JointError):
                self.stop()
                if isinstance(reason, MotionCancelledError):
                    wait_through(self.clock, self._rest.coming(f"the end of {what}"))
            raise

    def _homing_error(self) -> HomingError:
        if self.version < 2:
            return HomingError(f"{self.name}: homing ended without a home", self.name)
        report = self.get_fault()
        return HomingError(
            f"{self.name}: homing ended without a home: {report.fault} (data {report.data:g})",
            self.name,
            report.fault,
            report.data,
            "remove the cause, then clear_fault() and home() again",
        )


def ramp_time(distance: float, speed: float, acceleration: float) -> float:
    """Return the duration of a rest-to-rest move at these limits [s]."""
    if distance < speed**2 / acceleration:
        return 2.0 * math.sqrt(distance / acceleration)
    return distance / speed + speed / acceleration
