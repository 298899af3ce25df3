"""Cyclic exchange of one joint, in few bytes and few microseconds, with a count of bad cycles.

The arithmetic uses plain floats: for a single value, numpy takes longer than the exchange.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import cycle

from bioscara.bus import Transaction
from bioscara.drivers.joint.feedback import EncoderFeedback
from bioscara.drivers.joint.readiness import Readiness
from bioscara.drivers.joint.sample import FLAGS, JointSample, Quality, Setpoint
from bioscara.drivers.link.session import Session
from bioscara.errors import BioscaraError, CommunicationError, CorruptFrameError, JointLostError
from bioscara.model import JointParameters
from bioscara.protocol import READ, WRITE, Answer, Flags, Message, Register

LOST_AFTER = 3
"""Bad cycles in a row after which a joint counts as lost."""

_TRACK, _TRACKLOAD = WRITE[Register.TRACK], WRITE[Register.TRACKLOAD]
_STATE = READ[Register.STATE]
_MOVE, _ANGLE = WRITE[Register.MOVETOANGLE], READ[Register.ANGLEMOVED]
_SPEED = READ[Register.GETENCODERRPM]
_RPM, _STOP, _SOFT = WRITE[Register.SETRPM], WRITE[Register.STOP], 1.0
_REFUSED = int(Flags.REFUSED)
_REASONS = int(Flags.STALL | Flags.BUSY | Flags.NOTENABLED | Flags.FAULT)
"""Flags that are a reason to refuse a setpoint."""
_HALTED = int(Flags.STALL | Flags.NOTENABLED)

Outcome = JointSample | BioscaraError
"""Result of a cycle for one joint."""
Result = bytes | CommunicationError


class CyclicExchange:
    """Frames of one joint for a cycle, and their outcome.

    Attributes:
        bad_cycles: Consecutive cycles without an answer.
        failures: Cycles without an answer since the object was made.
    """

    __slots__ = (
        "_feedback", "_load_due", "_load_turns", "_message", "_next_message", "_parameters",
        "_readiness", "_repeats_load", "_second", "_sent", "_session", "_values", "bad_cycles",
        "failures",
    )  # fmt: skip

    def __init__(
        self,
        session: Session,
        feedback: EncoderFeedback,
        readiness: Readiness,
        parameters: JointParameters,
    ) -> None:
        self._session, self._feedback, self._readiness = session, feedback, readiness
        self._parameters = parameters
        self._message = _STATE
        self._values: tuple[float, ...] = ()
        self._second: Message | None = None
        self._sent: tuple[Transaction, ...] = ()
        self.bad_cycles = 0
        self.failures = 0
        self.ask_load(1)

    def ask_load(self, turns: int, due: int = 0) -> None:
        """Choose in which cycles :meth:`track` requests the load, from a joint that reports it.

        The samples of the cycles in between repeat the load.

        Args:
            turns: Number of cycles from one to the next; 0 for none.
            due: Number of cycles before the first; less than ``turns``.
        """
        self._load_turns, self._load_due = turns, due
        self.renew()

    def renew(self) -> None:
        """Adapt to the firmware of the joint, after its session was opened."""
        turns = self._load_turns if self._session.reports_load else 0
        messages = [_TRACK] * max(turns, 1)
        if turns:
            messages[self._load_due] = _TRACKLOAD
        self._repeats_load = turns > 0
        self._next_message = cycle(messages).__next__

    def track(self, setpoint: Setpoint) -> tuple[Transaction, ...]:
        """Return the transactions that send a checked setpoint and request the state."""
        session, values = self._session, self._feedback.transmission.to_motor(setpoint)
        if session.version == 2:
            message = self._next_message()
            self._message, self._values, self._second = message, values, None
            self._sent = sent = (session.frame(message, values),)
            return sent
        return self._prepare_pair(_MOVE, values[:1], _ANGLE)

    def drive(self, velocity: float) -> tuple[Transaction, ...]:
        """Return the transaction that sends a checked velocity; its answer is only the flags."""
        return self._prepare(_RPM, (self._feedback.transmission.velocity_to_rpm(velocity),))

    def stop(self) -> tuple[Transaction, ...]:
        """Return the transaction that makes a velocity-driven joint ramp down.

        For version 1 that is a velocity of zero: after STOP, a joint with original firmware is
        disabled by its own deadman.
        """
        if self._session.version == 1:
            return self._prepare(_RPM, (0.0,))
        return self._prepare(_STOP, (_SOFT,))

    def state(self) -> tuple[Transaction, ...]:
        """Return the transactions that request the state."""
        if self._session.version == 2:
            return self._prepare(_STATE, ())
        return self._prepare_pair(_ANGLE, (), _SPEED)

    def again(self) -> tuple[Transaction, ...]:
        """Return the same transactions again.

        A joint that executed them answers from memory; one that refused them gets a new sequence
        number. Every version 1 frame of a cycle is absolute and may be executed twice.
        """
        self._session.retries += 1
        return self._sent or self._prepare(self._message, self._values)

    def take(self, results: Iterator[Result], stamp: float, again: bool) -> Outcome:
        """Return the sample from the joint's answer, or the error.

        Args:
            results: The results of the bus call; those of this joint's transactions are next.
            stamp: Time of their arrival [s].
            again: Whether the transactions can still be repeated in this cycle. The reason of a
                refusal that the flags do not explain is then not requested: most likely the frame
                arrived broken, and the request takes longer than a repetition.
        """
        session, feedback, message = self._session, self._feedback, self._message
        try:
            if self._second is not None:
                pair = ((message, next(results)), (self._second, next(results)))
                sample = self._take_pair(pair, stamp)
            else:
                values, flags = session.take(message, next(results))
                if flags & _REFUSED and session.version == 2:
                    self._sent = ()
                    if again and not flags & _REASONS:
                        return CorruptFrameError(
                            "the joint refused a frame", self._parameters.address
                        )
                    return session.refusal(message)
                if message is _TRACK:
                    load = feedback.last.load_percent if self._repeats_load else None
                    sample = feedback.sample(values, flags, stamp, load)
                elif values:
                    sample = feedback.sample(values, flags, stamp)
                else:
                    sample = feedback.last._replace(flags=FLAGS[flags])
        except BioscaraError as error:
            return error
        self.bad_cycles = 0
        feedback.last = sample
        return sample

    def skip(self) -> JointSample:
        """Return the last sample, marked STALE, for a cycle in which the joint is not addressed.

        Nothing was requested, so this does not count as a bad cycle.
        """
        feedback = self._feedback
        if feedback.last.quality is Quality.FRESH:
            feedback.last = feedback.last._replace(quality=Quality.STALE)
        return feedback.last

    def hold_last_sample(self, problem: CommunicationError) -> Outcome:
        """Return the outcome of a bad cycle.

        That is the last sample, marked STALE; after :data:`LOST_AFTER` bad cycles in a row a
        :class:`~bioscara.errors.JointLostError`; without any sample, the problem itself.

        A version 1 joint that does not acknowledge is lost at once: it may be restarting, and its
        original firmware would block the whole bus if it was addressed in the next cycle.
        """
        self.bad_cycles += 1
        self.failures += 1
        feedback, name, address = self._feedback, self._parameters.name, self._parameters.address
        if self.bad_cycles >= LOST_AFTER or self._session.timing.silent:
            plural = "s" * (self.bad_cycles > 1)
            return JointLostError(
                f"{name} ({address:#04x}) is lost: {self.bad_cycles} bad cycle{plural} in a row, "
                f"{self.failures} in all; the last one: {problem}; check its power and its wiring",
                address,
                name,
                self.bad_cycles,
                problem,
            )
        if feedback.last.quality is Quality.UNKNOWN:
            return problem
        feedback.last = feedback.last._replace(quality=Quality.STALE)
        return feedback.last

    def _prepare(self, message: Message, values: tuple[float, ...]) -> tuple[Transaction, ...]:
        self._message, self._values, self._second = message, values, None
        self._sent = sent = (self._session.frame(message, values),)
        return sent

    def _prepare_pair(
        self, message: Message, values: tuple[float, ...], second: Message
    ) -> tuple[Transaction, ...]:
        """Prepare two frames for a version 1 joint, of which no answer carries a whole sample."""
        frame = self._session.frame
        self._message, self._values, self._second = message, values, second
        self._sent = sent = (frame(message, values), frame(second))
        return sent

    def _take_pair(self, results: tuple[tuple[Message, Result], ...], stamp: float) -> JointSample:
        """Return the sample from the two answers of a version 1 joint."""
        feedback, session = self._feedback, self._session
        before = session.flags
        answers: list[Answer] = []
        problem: CommunicationError | None = None
        for message, result in results:
            try:
                answers.append(session.take(message, result))
            except CommunicationError as error:
                # The other answer still shows whether the joint is present.
                problem = problem or error
        if problem is not None:
            raise problem
        first, second = answers
        flags = second.flags
        moves = self._message is _MOVE
        # A velocity computed from the positions shows nothing that they do not show.
        reported = 0.0
        if moves:
            position = feedback.position_of(second.values[0], flags)
            velocity = _slope(feedback.last, position, stamp)
        else:
            position = feedback.position_of(first.values[0], flags)
            reported = velocity = feedback.transmission.velocity_from_rpm(second.values[0])
        try:
            feedback.plausibility.check(
                feedback.last, position, reported, (first.flags, flags), stamp
            )
        except CorruptFrameError:
            session.flags = before
            raise
        if moves and flags & _HALTED:
            self._readiness.require_ready()
        return JointSample(position, velocity, FLAGS[flags], None, None, Quality.FRESH, stamp)


def _slope(last: JointSample, position: float | None, stamp: float) -> float:
    if position is None or last.position is None or stamp <= last.stamp:
        return 0.0
    return (position - last.position) / (stamp - last.stamp)
