"""Base class of a joint: identity, presence, flags and faults."""

from __future__ import annotations

import math
from dataclasses import replace

from bioscara.arguments import number, shown
from bioscara.bus import Bus
from bioscara.clock import Clock
from bioscara.drivers.joint.sample import FLAGS, UNKNOWN, JointSample, Quality
from bioscara.drivers.joint.transmission import Transmission
from bioscara.drivers.link.messages import FaultReport, Hello
from bioscara.drivers.link.plausibility import Plausibility, insist, said_twice
from bioscara.drivers.link.session import TRIES, Session
from bioscara.errors import (
    BioscaraError,
    IncorrectStateError,
    InvalidArgumentError,
    JointResetError,
    NotEnabledError,
    NotHomedError,
    NotSupportedError,
    StalledError,
)
from bioscara.model import JointParameters
from bioscara.protocol import Capability, Fault, Flags, JointState, Register

# Plain numbers: an operation on an IntFlag costs more than the rest of an exchange.
_OBSTACLES = int(Flags.STALL | Flags.NOTENABLED | Flags.NOTHOMED)
_NOTHOMED = int(Flags.NOTHOMED)


class JointConnection:
    """One joint on a bus; :class:`~bioscara.drivers.Joint` adds the operations.

    Args:
        bus: Bus of the joint.
        clock: Time of that bus.
        parameters: Parameters of the joint.

    Attributes:
        bus: The bus.
        clock: The clock.
        parameters: The parameters.
        session: The joint's frames.
        transmission: Conversion between joint and motor; changes when the joint is homed.
        plausibility: Plausibility check of a version 1 joint's answers.
        last: The newest sample; of quality UNKNOWN before there was one.
        encoder_deg: Encoder angle in the newest answer to :meth:`read_state` [deg], homed or not;
            NaN before there was one.
        may_be_energised: Whether the motor was engaged, or found engaged, and was not observed to
            be released since; outlives the session.
    """

    def __init__(self, bus: Bus, clock: Clock, parameters: JointParameters) -> None:
        self.bus, self.clock, self.parameters = bus, clock, parameters
        self.session = Session(bus, clock, parameters.name, parameters.number, parameters.address)
        self.transmission = Transmission(parameters.reduction)
        self.plausibility = Plausibility(parameters)
        self.last = UNKNOWN
        self.encoder_deg = math.nan
        self.may_be_energised = False
        self._offset_known = False
        self._blocking = Register.NONE

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} at {self.parameters.address:#04x}>"

    @property
    def name(self) -> str:
        """Name of the joint."""
        return self.parameters.name

    @property
    def hello(self) -> Hello | None:
        """The joint's answer to HELLO; None for a version 1 joint or before ``init``."""
        return self.session.hello

    @property
    def version(self) -> int:
        """Version of the protocol that the joint speaks; 0 before ``init``."""
        return self.session.version

    @property
    def current_blocking_command(self) -> Register:
        """The blocking command that this object started and has not finished."""
        return self._blocking

    def init(self) -> None:
        """Identify the joint and open a session; a joint that is still homed stays homed.

        Nothing moves. May be called again at any time, and must be after a
        :class:`JointResetError`.

        Raises:
            CommunicationError: The joint does not answer.
            WrongJointError: Another joint answers.
            NotSupportedError: The joint speaks a newer protocol.
        """
        self._blocking = Register.NONE
        self._offset_known = False
        self.last = UNKNOWN
        self.session.open()
        if not self.session.flags & Flags.NOTENABLED:
            self.may_be_energised = True
        if not self.session.flags & Flags.NOTHOMED:
            try:
                self._adopt_offset(self.get_homing_offset())
            except BioscaraError:
                self.session.close()
                raise

    def deinit(self) -> None:
        """Release the joint; nothing is sent, so disable it first."""
        self._offset_known = False
        self._blocking = Register.NONE
        self.last = UNKNOWN
        self.session.close()

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
            )

    def get_flags(self) -> Flags:
        """Request the flags."""
        return FLAGS[self.session.read(Register.PING).flags]

    def is_homed(self) -> bool:
        """Ask whether the joint knows its position and its offset is known here."""
        return not self.get_flags() & Flags.NOTHOMED and self._offset_known

    def is_enabled(self) -> bool:
        """Ask whether the motor is engaged."""
        return not self.get_flags() & Flags.NOTENABLED

    def is_stalled(self) -> bool:
        """Ask whether the joint detected a stall."""
        return bool(self.get_flags() & Flags.STALL)

    def is_busy(self) -> bool:
        """Ask whether a blocking command is running."""
        return bool(self.get_flags() & Flags.BUSY)

    def get_homing_offset(self) -> float:
        """Request the joint position at encoder zero that the joint stores [rad or m]."""

        def ask() -> float:
            return self.session.read(Register.HOMEOFFSET).values[0]

        # Every position depends on it, and version 1 has no check byte.
        return ask() if self.version == 2 else said_twice(ask, TRIES, f"{self.name} homing offset")

    def set_homing_offset(self, offset: float) -> None:
        """Store the joint position at encoder zero on the joint, read it back and use it.

        Zero is what a joint has after power-up, so a later host takes it for "none".

        Args:
            offset: Joint position at encoder zero [rad or m].

        Raises:
            InvalidArgumentError: Not finite.
            IncorrectStateError: The joint returns a number other than the one written.
        """
        offset = self._number("homing offset", offset)
        self.session.write(Register.HOMEOFFSET, offset)
        kept = self.get_homing_offset()
        if abs(kept - offset) > 1e-6 * max(1.0, abs(offset)):
            raise IncorrectStateError(
                f"{self.name}: homing offset {offset:g} was written, {kept:g} came back", self.name
            )
        self._adopt_offset(kept)

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
        self.session.require_v2("get_bus_errors")
        if self.hello is None or not self.hello.capabilities & Capability.BUS_ERRORS:
            raise NotSupportedError(
                f"{self.name}: its firmware does not count errors of the bus; flash firmware/joint "
                "of this host's version"
            )
        return int(self.session.read(Register.BUSERRORS).values[0])

    def clear_fault(self, fault: str | None = None) -> None:
        """Acknowledge the latched fault; the joint stays disabled and nothing moves.

        Args:
            fault: Name of the reported fault; None for any latched fault.

        Raises:
            NotSupportedError: A version 1 joint latches none; ``enable`` clears its stall.
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

    def read_state(self) -> JointSample:
        """Request position, velocity, flags and, from a version 2 joint, state and load."""
        session, velocity_of = self.session, self.transmission.velocity_from_rpm
        if session.version == 2:
            (angle_deg, rpm, state, load), flags = session.read(Register.STATE)
            self.encoder_deg = angle_deg
            position, velocity = self.position_of(angle_deg, flags), velocity_of(rpm)
            doing: JointState | None = joint_state(state)
        else:
            position, velocity, flags = insist(self._ask_v1, TRIES)
            doing, load = None, None
        self.last = JointSample(
            position, velocity, FLAGS[flags], doing, load, Quality.FRESH, self.clock.now()
        )
        return self.last

    def _ask_v1(self) -> tuple[float | None, float, int]:
        angle = self.session.read(Register.ANGLEMOVED)
        speed = self.session.read(Register.GETENCODERRPM)
        position = self.position_of(angle.values[0], speed.flags)
        velocity = self.transmission.velocity_from_rpm(speed.values[0])
        flags = (angle.flags, speed.flags)
        self.plausibility.judge(self.last, position, velocity, flags, self.clock.now())
        self.encoder_deg = angle.values[0]
        return position, velocity, speed.flags

    def position_of(self, angle_deg: float, flags: int) -> float | None:
        """Return the joint position of an encoder angle [deg]; None if not homed."""
        if flags & _NOTHOMED or not self._offset_known:
            return None
        return self.transmission.position_from_deg(angle_deg)

    def _adopt_offset(self, offset: float) -> None:
        # Zero is the power-up value: the host that homed died before it wrote the offset.
        self._offset_known = offset != 0.0
        self.transmission = replace(self.transmission, offset=offset)
        # Its earlier positions refer to another zero.
        self.last = self.last._replace(position=None)

    def is_ready(self) -> bool:
        """Return whether :meth:`require_ready` would return; nothing is sent."""
        session = self.session
        return (
            session.version != 0
            and not session.flags & _OBSTACLES
            and self._offset_known
            and self._blocking == Register.NONE
        )

    def require_ready(self, *, homed: bool = True) -> None:
        """Raise unless the joint was initialised and, by its last flags, can move.

        Raises:
            NotInitializedError, JointResetError, NotEnabledError, NotHomedError, StalledError,
            IncorrectStateError: The condition that prevents a motion.
        """
        self._require_no_blocking()
        flags = self.session.flags
        if flags & Flags.STALL:
            raise StalledError(
                f"{self.name}: the joint stalled",
                self.name,
                f"remove the obstacle, then {'clear_fault() and ' * (self.version == 2)}enable()",
            )
        if flags & Flags.NOTENABLED:
            raise NotEnabledError(f"{self.name}: it is not enabled", self.name, "enable() first")
        if homed and (flags & Flags.NOTHOMED or not self._offset_known):
            raise NotHomedError(f"{self.name}: it is not homed; home() first", self.name)

    def _require_no_blocking(self) -> None:
        self.session.require_open()
        if self._blocking is not Register.NONE:
            raise IncorrectStateError(
                f"{self.name}: {self._blocking.name} is running; let it end or stop() it",
                self.name,
            )

    def _number(self, what: str, value: float) -> float:
        """Return a finite number as a float; fast for plain numbers."""
        if type(value) is float and value - value == 0.0:
            return value
        return number(f"{self.name} {what}", value)


_STATES = {state.value: state for state in JointState}


def joint_state(code: float) -> JointState | None:
    """Return the state with this number; None if only newer firmware defines it."""
    return _STATES.get(int(code))
