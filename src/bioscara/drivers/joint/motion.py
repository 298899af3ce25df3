"""Motion of one joint: enable, move, stop, disable."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial

from bioscara.arguments import flag, whole
from bioscara.drivers.joint.polling import (
    Cancel,
    Progress,
    arrived,
    check_callbacks,
    idle,
    wait_for,
    wait_for_rest,
)
from bioscara.drivers.joint.sample import JointSample
from bioscara.drivers.joint.settings import JointSettings
from bioscara.drivers.joint.transmission import DEG_PER_MICROSTEP
from bioscara.drivers.link.errors import fault_error
from bioscara.drivers.link.plausibility import insist
from bioscara.drivers.link.session import TRIES
from bioscara.errors import (
    CommunicationError,
    JointError,
    LimitError,
    MotionCancelledError,
    NotEnabledError,
    NotHomedError,
)
from bioscara.protocol import SILENCE, BrakeMode, Fault, Flags, Register

_ORIENTATION_TIMEOUT = 5.0
"""Time limit of the orientation check [s]."""
_ORIENTATION_MAX_DEG = 10.0
_STOP_HARD, _STOP_SOFT = 0, 1
_MOVE_MARGIN = 2.0
"""Time that a move may take beyond twice its expected duration [s]."""
_STEPS_MAX = 2**31 - 1


class JointMotion(JointSettings):
    """Enable, disable, move and stop."""

    def enable(self, drive_percent: int | None = None, hold_percent: int | None = None) -> None:
        """Engage the motor at its present position, with stall detection and the configured limits.

        Original firmware (version 1) turns and checks nothing here: it compares motor and encoder
        at power-up, and engages a motor that has no supply. A version 2 joint checks by a movement
        of at most 3 degrees of the motor that motor and encoder agree: the first time after it
        booted, and where friction held the rotor opposite to its field.

        Args:
            drive_percent: Motor current in motion; None for the configured one.
            hold_percent: Motor current at standstill; None for the configured one.

        Raises:
            LimitError: A current is not between 1 and 100 %.
            JointFaultError: A fault is latched, or the check failed.
            NotEnabledError: The joint did not engage.
        """
        parameters = self.parameters
        drive, hold = parameters.drive_current_percent, parameters.hold_current_percent
        if drive_percent is not None:
            drive = whole(f"{self.name} drive current", drive_percent)
        if hold_percent is not None:
            hold = whole(f"{self.name} hold current", hold_percent)
        self._require_no_blocking()
        self._check_limit("drive current", drive, 1, 100, "%", "disable() switches it off")
        self._check_limit("hold current", hold, 1, 100, "%", "disable() switches it off")
        self.check_acceleration(parameters.max_acceleration)
        # If only the answer is lost, the motor is engaged.
        self.may_be_energised = True
        self.session.write(Register.SETUP, drive, hold)
        self._supervise(idle, _ORIENTATION_TIMEOUT, "enabling")
        if self.session.flags & Flags.NOTENABLED:
            self.raise_fault()
            raise NotEnabledError(f"{self.name}: the motor did not engage", self.name)
        if parameters.stall_threshold:
            self.enable_stallguard()
        self.set_max_acceleration(parameters.max_acceleration)
        self.set_max_velocity(parameters.max_velocity)

    def disable(self) -> None:
        """Ramp down, wait for standstill and release the motor.

        Every step is tried, even if an earlier one failed.

        Raises:
            CommunicationError, JointError: The first error of these steps.
        """
        self.session.require_open()
        steps: tuple[Callable[[], object], ...] = (
            self.stop,
            partial(wait_for_rest, self, "disable"),
            partial(self.set_hold_current, 0),
            partial(self.set_drive_current, 0),
            partial(self.set_brake_mode, BrakeMode.FREEWHEEL),
            self._wait_released,
        )
        problem: CommunicationError | JointError | None = None
        for step in steps:
            try:
                step()
            except (CommunicationError, JointError) as error:
                problem = problem or error
        if problem is not None:
            raise problem
        self.may_be_energised = False

    def stop(self, *, hard: bool = False) -> None:
        """Ramp down and hold; ends a blocking command. Never refused because of the joint's state.

        A version 1 joint that has not yet taken a blocking command or a move in steps takes it
        first: the call then waits for up to 25 ms.

        Args:
            hard: True for the hardest deceleration instead of the configured one; original
                firmware (version 1) ignores it and takes the configured one.
        """
        self._blocking = Register.NONE
        flag(f"{self.name} hard", hard)
        self.session.stop(_STOP_HARD if hard else _STOP_SOFT)

    def get_position(self) -> float:
        """Request the position [rad or m].

        Raises:
            NotHomedError: The joint does not know its position.
        """
        position = insist(self._ask_position, TRIES)
        if position is None:
            raise NotHomedError(f"{self.name}: no position before home()", self.name)
        return position

    def _ask_position(self) -> float | None:
        answer = self.session.read(Register.ANGLEMOVED)
        position = self.position_of(answer.values[0], answer.flags)
        if self.version == 1:
            flags = (answer.flags, answer.flags)
            self.plausibility.judge(self.last, position, 0.0, flags, self.clock.now())
        return position

    def get_velocity(self) -> float:
        """Request the filtered velocity [rad/s or m/s]; it lags the motion by some 60 ms."""
        answer = self.session.read(Register.GETENCODERRPM)
        return self.transmission.velocity_from_rpm(answer.values[0])

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
        self.require_ready()
        position = self.check_position(position)
        self.session.write(Register.MOVETOANGLE, self.transmission.position_to_deg(position))
        self.require_ready()

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
        self.require_ready()
        velocity = self.check_velocity(velocity)
        if velocity:
            self._check_room(velocity)
        self.session.write(Register.SETRPM, self.transmission.velocity_to_rpm(velocity))
        self.require_ready()

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
            cancel: Called with each sample.

        Raises:
            InvalidArgumentError: The number is not whole.
            LimitError: It would end outside the limits.
            IncorrectStateError: It did not arrive in twice the expected time.
            MotionCancelledError: ``cancel`` returned True.
        """
        self.require_ready(homed=False)
        steps = whole(f"{self.name} steps", steps)
        check_callbacks(progress, cancel)
        self._check_limit("steps", steps, -_STEPS_MAX, _STEPS_MAX, "microsteps")
        distance = self.transmission.microsteps_to_distance(steps)
        position = self.read_state().position
        if self.version == 1:
            # It would move although it stalled or was disabled since its last answer.
            self.require_ready(homed=False)
        if position is not None:
            self.check_position(position + distance)
        target_deg = self.encoder_deg + steps * DEG_PER_MICROSTEP
        duration = ramp_time(abs(distance), self.max_velocity, self.max_acceleration)
        self.session.write(Register.MOVESTEPS, steps, repeat=False)
        done = arrived(self, target_deg, duration)
        self._supervise(done, 2.0 * duration + _MOVE_MARGIN, "the move", progress, cancel)
        self.raise_fault()
        self.require_ready(homed=False)

    def check_orientation(self, motor_angle: float = math.radians(1.0)) -> None:
        """Turn the motor slightly and back, to check that motor and encoder agree.

        Args:
            motor_angle: Angle by which the motor turns, at most 10 degrees [rad of the motor].

        Raises:
            LimitError: The angle is too large.
            JointFaultError: They do not agree (version 2; a version 1 joint corrects it).
        """
        angle_deg = math.degrees(self._number("orientation check angle", motor_angle))
        self.require_ready(homed=False)
        self._check_limit("orientation check angle", angle_deg, 0.0, _ORIENTATION_MAX_DEG, "deg")
        self._blocking = Register.CHECKORIENTATION
        try:
            self.session.write(Register.CHECKORIENTATION, angle_deg, repeat=False)
            self._supervise(idle, _ORIENTATION_TIMEOUT, "the orientation check")
        finally:
            self._blocking = Register.NONE
        self.raise_fault()

    def require_room(self, velocity: float, state: JointSample, time: float) -> None:
        """Raise if the joint, driven at ``velocity`` from now, could not stop within its limits.

        Args:
            velocity: Not zero [rad/s or m/s].
            state: Its last state.
            time: Present time [s]; the joint may have moved since the state.

        Raises:
            LimitError: It could not stop in time.
            NotHomedError: Its position is unknown.
        """
        velocity = self._number("velocity", velocity)
        if state.position is None:
            raise NotHomedError(f"{self.name}: its position is not known; home() again", self.name)
        sign = math.copysign(1.0, velocity)
        speed = max(velocity * sign, state.velocity * sign)
        ahead = SILENCE + time - state.stamp
        end = state.position + sign * (speed * ahead + speed**2 / (2.0 * self.max_acceleration))
        parameters = self.parameters
        if end * sign <= (parameters.upper if sign > 0.0 else -parameters.lower):
            return
        raise LimitError(
            f"{self.name} position where {velocity:g} {parameters.unit}/s would end",
            end,
            parameters.lower,
            parameters.upper,
            parameters.unit,
            "the joint was stopped: turn back, go slower or use set_position()",
        )

    def _check_room(self, velocity: float) -> None:
        """Stop the joint and raise if it could not stop within the limits from ``velocity``."""
        state = self.read_state()
        if state.position is None:
            self.raise_fault()
        elif state.flags & (Flags.STALL | Flags.NOTENABLED):
            return  # The refusal of the setpoint states the reason.
        try:
            self.require_room(velocity, state, state.stamp)
        except LimitError:
            self.stop()
            raise

    def _supervise(
        self,
        done: Callable[[JointSample], bool],
        timeout: float,
        what: str,
        progress: Progress | None = None,
        cancel: Cancel | None = None,
    ) -> None:
        """Wait for the end of a motion; an exception during the wait also ends the motion."""
        try:
            wait_for(self, done, timeout, what, progress, cancel)
        except BaseException as reason:
            with suppress(CommunicationError, JointError):
                self.stop()
                if isinstance(reason, MotionCancelledError):
                    wait_for_rest(self, what)
            raise

    def _wait_released(self) -> None:
        if self.version == 2:
            # A version 2 joint removes the current once the rotor no longer oscillates.
            wait_for_rest(self, "disable")

    def raise_fault(self) -> None:
        """Raise the latched fault, if the joint's last flags show one."""
        if self.version == 2 and self.session.flags & Flags.FAULT:
            report = self.get_fault()
            if report.fault != Fault.NONE.name:
                raise fault_error(self.name, report)


def ramp_time(distance: float, speed: float, acceleration: float) -> float:
    """Return the duration of a rest-to-rest move at these limits [s]."""
    if distance < speed**2 / acceleration:
        return 2.0 * math.sqrt(distance / acceleration)
    return distance / speed + speed / acceleration
