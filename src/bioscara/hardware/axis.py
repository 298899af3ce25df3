"""One joint inside the hardware component: its handles, its mode and its last sample."""

from __future__ import annotations

import math

from bioscara.clock import Clock
from bioscara.drivers import Joint, JointSample, Quality, Setpoint
from bioscara.drivers.joint.sample import UNKNOWN
from bioscara.errors import (
    BioscaraError,
    BusStuckError,
    JointError,
    JointLostError,
    JointResetError,
)
from bioscara.hardware.command_modes import MOTION, Mode
from bioscara.hardware.homing import Homing
from bioscara.hardware.interfaces import HOME, POSITION, VELOCITY, CommandInterface, StateInterface
from bioscara.protocol import Flags

_HALTED = int(Flags.STALL | Flags.NOTENABLED | Flags.FAULT)
HALTED = tuple(bool(flags & _HALTED) for flags in range(256))
"""For each flags byte, whether the joint does not follow its commands: an operation on IntFlag
takes longer than all else that a cycle does with the flags."""
# A member of an enumeration takes longer to look up than to compare.
_TRACK, _FRESH = Mode.TRACK, Quality.FRESH
_new = tuple.__new__


class Axis:
    """One joint and its state that is kept from cycle to cycle.

    Attributes:
        joint: The joint.
        name: Name of the joint.
        parameters: Its parameters.
        homing: Its homing.
        mode: Its command mode.
        halted: Why it takes no commands until an intervention; None while it does.
        sample: Its last sample.
        answered: Whether it came as the answer to a write in the last cycle.
        arrival: Last delay from the start of a cycle to the arrival of its setpoint [s].
        stamp: When ``sample`` was measured [s].
        previous: Position that was commanded in the last cycle [rad or m]; NaN if none was.
        lower: Lowest position that the joint may take [rad or m].
        upper: Highest position that it may take [rad or m].
        velocity_limit: Highest speed that it may have [rad/s or m/s].
        position: State interface, as are ``velocity`` and ``home``.
        position_command: Command interface, as are ``velocity_command`` and ``home_command``.
    """

    __slots__ = (
        "answered", "arrival", "halted", "home", "home_command", "homing", "joint", "lower",
        "mode", "name", "parameters", "position", "position_command", "previous", "sample", "stamp",
        "upper", "velocity", "velocity_command", "velocity_limit",
    )  # fmt: skip

    def __init__(self, joint: Joint, clock: Clock) -> None:
        self.joint, self.name, self.parameters = joint, joint.name, joint.parameters
        self.homing = Homing(joint, clock)
        self.mode = Mode.NONE
        self.halted: BioscaraError | None = None
        self.sample: JointSample = UNKNOWN
        self.answered = False
        self.arrival = 0.0
        self.stamp = -math.inf
        self.previous = math.nan
        self.lower, self.upper = joint.parameters.lower, joint.parameters.upper
        self.velocity_limit = joint.parameters.max_velocity
        self.position = StateInterface(joint.name, POSITION)
        self.velocity = StateInterface(joint.name, VELOCITY)
        self.home = StateInterface(joint.name, HOME)
        self.position_command = CommandInterface(joint.name, POSITION)
        self.velocity_command = CommandInterface(joint.name, VELOCITY)
        self.home_command = CommandInterface(joint.name, HOME)

    @property
    def version(self) -> int:
        """Version of the protocol that the joint speaks; 0 before it is initialised."""
        return self.joint.version

    @property
    def homed(self) -> bool:
        """Whether the joint knew its position at its last answer."""
        return self.sample.position is not None

    @property
    def unreachable(self) -> bool:
        """Whether the joint cannot be reached until it is initialised again."""
        halted = self.halted
        lost = halted is not None and isinstance(halted, JointLostError | BusStuckError)
        return lost or self.joint.session.version == 0

    def why_halted(self) -> BioscaraError:
        """Return why a joint that answers does not move; requests its fault."""
        try:
            self.joint.raise_fault()
            self.joint.readiness.require_ready()
        except BioscaraError as error:
            return error
        return JointError(f"{self.name}: the joint stopped and did not say why", self.name)

    def halt(self, reason: BioscaraError) -> bool:
        """Make the joint take no commands until an intervention.

        Returns:
            Whether it was not halted before: it is not halted for a second reason.
        """
        if self.halted is not None:
            return False
        self.halted = reason
        # A lost joint stops autonomously, one of version 1 may not: it is stopped once reachable.
        lost = isinstance(reason, JointLostError | BusStuckError) and self.joint.version == 1
        if not lost:
            self.homing.abandon()
        if self.mode is Mode.HOME:
            self.home_command.value, self.home_command.problem = 0.0, reason
        return True

    def refusal(self, mode: Mode) -> BioscaraError | None:
        """Return why the joint cannot take up ``mode``, by its last sample; None if it can.

        The fault of one that stopped is requested.

        Homing enables a disabled joint, so being disabled does not prevent it.
        """
        if self.halted is not None:
            return self.halted
        if mode is not Mode.HOME and HALTED[self.sample.flags]:
            return self.why_halted()
        return None

    def store(self, sample: JointSample, stamp: float) -> None:
        """Store the joint's sample; a stale sample keeps the time at which it was fresh."""
        self.sample = sample
        if sample.quality is _FRESH:
            self.stamp = stamp

    def mark_missed(self, reason: BioscaraError) -> None:
        """Record that the joint did not report its state.

        Its last sample is marked stale; that of a joint that restarted or is lost is discarded.
        """
        lost = isinstance(reason, (JointLostError, JointResetError))
        if lost or self.joint.session.version == 0:
            self.forget()
        elif self.sample.quality is Quality.FRESH:
            self.sample = self.sample._replace(quality=Quality.STALE)

    def publish(self) -> None:
        """Copy the joint's last sample to the state interfaces."""
        # A tuple is unpacked in less time than two of its fields are looked up by name.
        measured, speed, _, _, _, quality, _ = self.sample
        position, velocity, home = self.position, self.velocity, self.home
        if measured is None:
            position.value, position.quality, home.value = math.nan, Quality.UNKNOWN, 0.0
        else:
            position.value, position.quality, home.value = measured, quality, 1.0
        velocity.value, velocity.quality, home.quality = speed, quality, quality
        position.stamp = velocity.stamp = home.stamp = self.stamp

    def forget(self) -> None:
        """Discard all values of the joint."""
        self.sample, self.stamp, self.answered = UNKNOWN, -math.inf, False
        self.publish()

    def rest_here(self) -> None:
        """Set the commands to the measured state: at rest, not homing.

        A joint that was pushed beyond a limit is held there; it can only be moved back.
        """
        self._hold_measured()
        self.velocity_command.value = self.home_command.value = 0.0

    def _hold_measured(self) -> None:
        measured = self.sample.position
        self.previous = math.nan
        if measured is None:
            self.position_command.value = math.nan
        else:
            self.position_command.value = measured
            self.joint.limits.start_from(measured)

    def change(self, mode: Mode) -> None:
        """Take up a mode that was checked; the commands are set to the measured state."""
        before, self.mode = self.mode, mode
        self.previous = math.nan
        if mode not in MOTION:
            self.home_command.value, self.home_command.problem = 0.0, None
        elif before not in MOTION:
            self.rest_here()
        elif mode is Mode.VELOCITY:
            limit = self.velocity_limit
            self.velocity_command.value = min(max(self.sample.velocity, -limit), limit)
        elif before is Mode.VELOCITY:
            self._hold_measured()

    def setpoint(self, period: float) -> Setpoint:
        """Return the setpoint of the joint for one period after its arrival.

        The position command belongs to one period after the start of the cycle; the frame arrives
        later by ``arrival``, over which the position is extrapolated with the velocity.

        Args:
            period: Time from cycle to cycle [s].
        """
        position = self.position_command.value
        if self.mode is _TRACK:
            velocity = self.velocity_command.value
        else:
            before = self.previous
            velocity = 0.0 if before != before else (position - before) / period  # noqa: PLR0124
            velocity = min(max(velocity, -self.velocity_limit), self.velocity_limit)
        self.previous = position
        lower, upper, arrival = self.lower, self.upper, self.arrival
        if lower <= position <= upper:
            # A single delay of the host must not carry over: never more than a period.
            position += velocity * (arrival if arrival < period else period)
            position = lower if position < lower else upper if position > upper else position
        # Setpoint(...) takes twice as long.
        return _new(Setpoint, (position, velocity))
