"""Measured state of one joint: its flags, position and velocity, and the zero of its position."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from bioscara.arguments import number
from bioscara.clock import Clock
from bioscara.drivers.joint.plausibility import Plausibility, first_plausible, read_twice
from bioscara.drivers.joint.sample import FLAGS, UNKNOWN, JointSample, Quality
from bioscara.drivers.joint.transmission import Transmission
from bioscara.drivers.link.session import TRIES, Session
from bioscara.errors import IncorrectStateError, NotHomedError
from bioscara.model import JointParameters
from bioscara.protocol import Flags, JointState, Register

# A plain number: an operation on an IntFlag costs more than the rest of the conversion.
_NOTHOMED = int(Flags.NOTHOMED)
_STATES = {state.value: state for state in JointState}
_FRESH = Quality.FRESH
_new = tuple.__new__


class EncoderFeedback:
    """Reads the state of one joint and converts it to joint units.

    The joint stores the position of its encoder's zero (the homing offset). Without a known offset
    there is no position.

    Attributes:
        transmission: Conversion between joint and motor; has the homing offset.
        plausibility: Plausibility check of a version 1 joint's answers.
        last: The newest sample; of quality UNKNOWN before there was one.
        encoder_deg: Encoder angle in the newest answer to :meth:`read` [deg], homed or not; NaN
            before there was one.
        offset_known: Whether the homing offset of the joint is known.
    """

    __slots__ = (
        "_clock", "_name", "_session", "encoder_deg", "last", "offset_known", "plausibility",
        "transmission",
    )  # fmt: skip

    def __init__(self, session: Session, clock: Clock, parameters: JointParameters) -> None:
        self._session, self._clock, self._name = session, clock, parameters.name
        self.transmission = Transmission(parameters.reduction)
        self.plausibility = Plausibility(parameters)
        self.last = UNKNOWN
        self.encoder_deg = math.nan
        self.offset_known = False

    def forget(self) -> None:
        """Discard the last sample and the homing offset."""
        self.last, self.offset_known = UNKNOWN, False

    def read(self) -> JointSample:
        """Request position, velocity, flags and, from a version 2 joint, state and load."""
        if self._session.version == 2:
            values, flags = self._session.read(Register.STATE)
            self.encoder_deg = values[0]
            self.last = self.sample(values, flags, self._clock.now())
        else:
            self.last = first_plausible(self._read_v1, TRIES)
        return self.last

    def read_position(self) -> float:
        """Request the position [rad or m].

        Raises:
            NotHomedError: The joint does not know its position.
        """
        position = first_plausible(self._read_position, TRIES)
        if position is None:
            raise NotHomedError(f"{self._name}: no position before home()", self._name)
        return position

    def read_velocity(self) -> float:
        """Request the filtered velocity [rad/s or m/s]; it lags the motion by some 60 ms."""
        answer = self._session.read(Register.GETENCODERRPM)
        return self.transmission.velocity_from_rpm(answer.values[0])

    def read_offset(self) -> float:
        """Request the joint position at encoder zero that the joint stores [rad or m].

        Raises:
            NotHomedError: The encoder has no zero yet.
        """
        self._require_homed()

        def request() -> float:
            return self._session.read(Register.HOMEOFFSET).values[0]

        if self._session.version == 2:
            return request()
        # Every position depends on it, and version 1 has no check byte.
        return read_twice(request, TRIES, f"{self._name} homing offset")

    def adopt_offset(self) -> None:
        """Request the homing offset and use it."""
        self._use(self.read_offset())

    def store_offset(self, offset: float) -> None:
        """Store the joint position at encoder zero on the joint, read it back and use it.

        Zero is the value of a joint after power-up, so a later host takes it for "none".

        Args:
            offset: Joint position at encoder zero [rad or m].

        Raises:
            InvalidArgumentError: Not finite.
            NotHomedError: The encoder has no zero yet.
            IncorrectStateError: The joint returns a number other than the one written.
        """
        offset = number(f"{self._name} homing offset", offset)
        self._require_homed()
        self._session.write(Register.HOMEOFFSET, offset)
        stored = self.read_offset()
        if abs(stored - offset) > 1e-6 * max(1.0, abs(offset)):
            raise IncorrectStateError(
                f"{self._name}: homing offset {offset:g} was written, {stored:g} came back",
                self._name,
            )
        self._use(stored)

    def erase_offset(self) -> None:
        """Erase the homing offset, here and on the joint.

        If this host dies before a new one is written, the next host must not use the old one.
        """
        self.offset_known = False
        self._session.write(Register.HOMEOFFSET, 0.0)

    def sample(
        self,
        values: Sequence[float],
        flags: int,
        stamp: float,
        load: float | None = None,
    ) -> JointSample:
        """Return the sample of an answer that arrived intact.

        Args:
            values: Encoder angle [deg] and speed of the motor [rpm]; then, where the joint reports
                them, its load [%], after the number of its state.
            flags: The joint's flags.
            stamp: When the answer arrived [s].
            load: Load of an answer that has none [%].
        """
        state: JointState | None = None
        count = len(values)
        if count == 3:
            angle_deg, rpm, load = values
        elif count == 2:
            angle_deg, rpm = values
        else:
            angle_deg, rpm, number_of_state, load = values
            # None for a state that only newer firmware defines.
            state = _STATES.get(int(number_of_state))
        position: float | None
        position, velocity = self.transmission.from_motor(angle_deg, rpm)
        if flags & _NOTHOMED or not self.offset_known:
            position = None
        # JointSample(...) takes twice as long.
        return _new(JointSample, (position, velocity, FLAGS[flags], state, load, _FRESH, stamp))

    def position_of(self, angle_deg: float, flags: int) -> float | None:
        """Return the joint position of an encoder angle [deg]; None if not homed."""
        if flags & _NOTHOMED or not self.offset_known:
            return None
        return self.transmission.position_from_deg(angle_deg)

    def _require_homed(self) -> None:
        self._session.require_open()
        if self._session.flags & Flags.NOTHOMED:
            raise NotHomedError(f"{self._name}: no homing offset before home()", self._name)

    def _read_v1(self) -> JointSample:
        angle = self._session.read(Register.ANGLEMOVED)
        speed = self._session.read(Register.GETENCODERRPM)
        (angle_deg,), (rpm,), stamp = angle.values, speed.values, self._clock.now()
        sample = self.sample((angle_deg, rpm), speed.flags, stamp)
        flags = (angle.flags, speed.flags)
        self.plausibility.check(self.last, sample.position, sample.velocity, flags, stamp)
        self.encoder_deg = angle_deg
        return sample

    def _read_position(self) -> float | None:
        answer = self._session.read(Register.ANGLEMOVED)
        position = self.position_of(answer.values[0], answer.flags)
        if self._session.version == 1:
            flags = (answer.flags, answer.flags)
            self.plausibility.check(self.last, position, 0.0, flags, self._clock.now())
        return position

    def _use(self, offset: float) -> None:
        # Zero is the power-up value: the host that homed died before it wrote the offset.
        self.offset_known = offset != 0.0
        self.transmission = replace(self.transmission, offset=offset)
        # Its earlier positions refer to another zero.
        self.last = self.last._replace(position=None)
