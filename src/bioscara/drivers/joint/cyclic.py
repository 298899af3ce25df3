"""Cyclic exchange of one joint, in few bytes and few microseconds, with a count of bad cycles.

The arithmetic uses plain floats: for a single value, numpy takes longer than the exchange.
"""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.bus import Transaction
from bioscara.drivers.joint.connection import JointConnection, joint_state
from bioscara.drivers.joint.sample import FLAGS, JointSample, Quality, Setpoint
from bioscara.errors import (
    BioscaraError,
    CommunicationError,
    CorruptFrameError,
    JointLostError,
)
from bioscara.protocol import READ, WRITE, Answer, Flags, Message, Register

LOST_AFTER = 3
"""Bad cycles in a row after which a joint counts as lost."""

_TRACK, _STATE = WRITE[Register.TRACK], READ[Register.STATE]
_MOVE, _ANGLE = WRITE[Register.MOVETOANGLE], READ[Register.ANGLEMOVED]
_SPEED = READ[Register.GETENCODERRPM]
_RPM, _STOP, _SOFT = WRITE[Register.SETRPM], WRITE[Register.STOP], 1.0
_REFUSED = int(Flags.REFUSED)
_REASONS = int(Flags.STALL | Flags.BUSY | Flags.NOTENABLED | Flags.FAULT)
"""Flags that are a reason to refuse a setpoint."""
_HALTED = int(Flags.STALL | Flags.NOTENABLED)

Outcome = JointSample | BioscaraError
"""Result of a cycle for one joint."""
Frame = tuple[Message, tuple[float, ...]]
Result = bytes | CommunicationError


class Cycle:
    """Frames of one joint for a cycle, and their outcome.

    Args:
        joint: The joint.

    Attributes:
        bad_cycles: Consecutive cycles without an answer.
        failures: Cycles without an answer since the object was made.
    """

    def __init__(self, joint: JointConnection) -> None:
        self._joint = joint
        self._frames: tuple[Frame, ...] = ()
        self._sent: tuple[Transaction, ...] = ()
        self.bad_cycles = 0
        self.failures = 0

    def track(self, setpoint: Setpoint) -> tuple[Transaction, ...]:
        """Return the transactions that send a checked setpoint and request the state."""
        joint = self._joint
        transmission = joint.transmission
        position, velocity = setpoint
        angle_deg = transmission.position_to_deg(position)
        if joint.session.version == 2:
            values = (angle_deg, transmission.velocity_to_rpm(velocity))
            self._frames = ((_TRACK, values),)
            self._sent = (joint.session.frame(_TRACK, values),)
            return self._sent
        return self._frame((_MOVE, (angle_deg,)), (_ANGLE, ()))

    def drive(self, velocity: float) -> tuple[Transaction, ...]:
        """Return the transaction that sends a checked velocity; its answer is only the flags."""
        return self._frame((_RPM, (self._joint.transmission.velocity_to_rpm(velocity),)))

    def stop(self) -> tuple[Transaction, ...]:
        """Return the transaction that makes a velocity-driven joint ramp down.

        For version 1 that is a velocity of zero: after STOP, a joint with original firmware is
        disabled by its own deadman.
        """
        if self._joint.session.version == 1:
            return self._frame((_RPM, (0.0,)))
        return self._frame((_STOP, (_SOFT,)))

    def state(self) -> tuple[Transaction, ...]:
        """Return the transactions that request the state."""
        if self._joint.session.version == 2:
            return self._frame((_STATE, ()))
        return self._frame((_ANGLE, ()), (_SPEED, ()))

    def again(self) -> tuple[Transaction, ...]:
        """Return the same transactions again.

        A joint that executed them answers from memory; one that refused them gets a new sequence
        number. Every version 1 frame of a cycle is absolute and may be executed twice.
        """
        self._joint.session.retries += 1
        return self._sent or self._frame(*self._frames)

    def take(self, results: Sequence[Result], stamp: float, *, again: bool = False) -> Outcome:
        """Return the sample from the joint's answer, or the error.

        Args:
            results: The results of this joint's transactions, in order.
            stamp: Time of their arrival [s].
            again: Whether the transactions can still be repeated in this cycle. The reason of a
                refusal that the flags do not explain is then not requested: most likely the frame
                arrived broken, and the request takes longer than a repetition.
        """
        session = self._joint.session
        try:
            if len(results) == 1:
                message = self._frames[0][0]
                values, flags = session.take(message, results[0])
                if flags & _REFUSED and session.version == 2:
                    self._sent = ()
                    if again and not flags & _REASONS:
                        return CorruptFrameError(
                            "the joint refused a frame", self._joint.parameters.address
                        )
                    return session.refusal(message)
                sample = self._sample(values, flags, stamp)
            else:
                sample = self._pair(results, stamp)
        except BioscaraError as error:
            return error
        self.bad_cycles = 0
        self._joint.last = sample
        return sample

    def skip(self) -> JointSample:
        """Return the last sample, marked STALE, for a cycle in which the joint is not addressed.

        Nothing was requested, so this does not count as a bad cycle.
        """
        joint = self._joint
        if joint.last.quality is Quality.FRESH:
            joint.last = joint.last._replace(quality=Quality.STALE)
        return joint.last

    def hold_last_sample(self, problem: CommunicationError) -> Outcome:
        """Return the outcome of a bad cycle.

        That is the last sample, marked STALE; after :data:`LOST_AFTER` bad cycles in a row a
        :class:`~bioscara.errors.JointLostError`; without any sample, the problem itself.

        A version 1 joint that does not acknowledge is lost at once: it may be restarting, and its
        original firmware would block the whole bus if it was addressed in the next cycle.
        """
        self.bad_cycles += 1
        self.failures += 1
        joint = self._joint
        if self.bad_cycles >= LOST_AFTER or joint.session.caution.silent:
            plural = "s" * (self.bad_cycles > 1)
            return JointLostError(
                f"{joint.name} ({joint.parameters.address:#04x}) is lost: {self.bad_cycles} bad "
                f"cycle{plural} in a row, {self.failures} in all; the last one: {problem}; check "
                "its power and its wiring",
                joint.parameters.address,
                joint.name,
                self.bad_cycles,
                problem,
            )
        if joint.last.quality is Quality.UNKNOWN:
            return problem
        joint.last = joint.last._replace(quality=Quality.STALE)
        return joint.last

    def _frame(self, *frames: Frame) -> tuple[Transaction, ...]:
        session = self._joint.session
        self._frames = frames
        self._sent = tuple(session.frame(message, values) for message, values in frames)
        return self._sent

    def _sample(self, values: tuple[float, ...], flags: int, stamp: float) -> JointSample:
        joint = self._joint
        if not values:
            return joint.last._replace(flags=FLAGS[flags])
        if len(values) == 2:
            state, load = None, None
        else:
            state, load = joint_state(values[2]), values[3]
        return JointSample(
            joint.position_of(values[0], flags),
            joint.transmission.velocity_from_rpm(values[1]),
            FLAGS[flags],
            state,
            load,
            Quality.FRESH,
            stamp,
        )

    def _pair(self, results: Sequence[Result], stamp: float) -> JointSample:
        joint, session = self._joint, self._joint.session
        before = session.flags
        answers: list[Answer] = []
        problem: CommunicationError | None = None
        for (message, _), result in zip(self._frames, results, strict=True):
            try:
                answers.append(session.take(message, result))
            except CommunicationError as error:
                # The other answer still shows whether the joint is present.
                problem = problem or error
        if problem is not None:
            raise problem
        first, second = answers
        flags = second.flags
        told = 0.0
        if self._frames[0][0] is _MOVE:
            position = joint.position_of(second.values[0], flags)
            velocity = _slope(joint.last, position, stamp)
        else:
            position = joint.position_of(first.values[0], flags)
            told = velocity = joint.transmission.velocity_from_rpm(second.values[0])
        try:
            joint.plausibility.judge(joint.last, position, told, (first.flags, flags), stamp)
        except CorruptFrameError:
            session.flags = before
            raise
        if self._frames[0][0] is _MOVE and flags & _HALTED:
            joint.require_ready()
        return JointSample(position, velocity, FLAGS[flags], None, None, Quality.FRESH, stamp)


def _slope(last: JointSample, position: float | None, stamp: float) -> float:
    if position is None or last.position is None or stamp <= last.stamp:
        return 0.0
    return (position - last.position) / (stamp - last.stamp)
