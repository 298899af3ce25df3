"""Session with one joint: protocol version, sequence numbers, repetitions, refusals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress

from bioscara.arguments import shown
from bioscara.bus import Bus, Transaction
from bioscara.clock import Clock
from bioscara.drivers.link.errors import exchange_failed, named_error, refused_error
from bioscara.drivers.link.handshake import acknowledges, identify, require_known
from bioscara.drivers.link.joint_reports import FaultReport, Hello
from bioscara.drivers.link.line import line_of
from bioscara.drivers.link.original import (
    CHECK_MOST,
    START_UP,
    OriginalTiming,
    forget_silence,
    note_silence,
)
from bioscara.errors import (
    BioscaraError,
    CommunicationError,
    CorruptFrameError,
    IncorrectStateError,
    InvalidArgumentError,
    JointError,
    JointResetError,
    NoAcknowledgeError,
    NotInitializedError,
    NotSupportedError,
    RefusedError,
    WrongJointError,
)
from bioscara.protocol import READ, WATCHDOG_MS, WRITE, Answer, Flags, Message, Refusal, Register
from bioscara.protocol.rows import Support

TRIES = 3
"""Number of tries of an exchange, as in the original driver."""
FIRMWARE = "joint firmware 0.1 or newer (protocol 2)"

# Plain integers: an IntFlag's operators take as long as the rest of decoding.
_ARMED, _REFUSED = int(Flags.ARMED), int(Flags.REFUSED)
_new = tuple.__new__
_PAUSE = 50e-6
"""Time between two tries of a frame [s]."""
_CHECK_PAUSE = 20e-3
"""Time between two readings of whether an orientation check has ended [s]."""
TICK_PAUSE = 2e-3
"""Time within which the joint's control tick takes a command [s]."""
_POWER_UP = Flags.NOTHOMED | Flags.NOTENABLED
_FAULT = READ[Register.FAULT]
_PING = READ[Register.PING]
_FORGOTTEN = frozenset((Refusal.NOT_ARMED.name, Refusal.WRONG_BOOT.name))
_OUT_OF_STEP = 120
"""Frames in a row without an intact answer after which the session is reopened: a joint that
missed 128 mistakes every newer one, STOP too, for an older one."""


class Session:
    """Session with one joint.

    Repetition is safe: version 2 repeats a frame with the sequence number it had, so that the
    joint executes it once; version 1 repeats only frames that may be executed twice.

    Only registers of the original firmware are requested from a version 1 joint, since it would
    answer others with fewer bytes than are read; after a command taken by its loop, nothing is sent
    to it for 25 ms (:mod:`bioscara.drivers.link.original`).

    Args:
        bus: Bus of the joint.
        clock: Time of that bus.
        joint: Name of the joint, for messages.
        number: Joint number expected in the answer.
        address: Its 7-bit address.

    Attributes:
        version: Protocol version in use; 0 before :meth:`open`.
        hello: Answer of a version 2 joint to HELLO.
        flags: The last flags received; before any were received, those after power-up.
        retries: Exchanges that were repeated since this object was made.
        timing: Timing state of a version 1 joint.
        original: Whether the joint spoke version 1 when it was identified last; outlives a session.
    """

    def __init__(self, bus: Bus, clock: Clock, joint: str, number: int, address: int) -> None:
        self._bus, self._clock = bus, clock
        self._joint, self._number, self._address = joint, number, address
        self.version = 0
        self.hello: Hello | None = None
        self.flags: int = int(_POWER_UP)
        self.retries = 0
        self.timing = OriginalTiming()
        self.original = False
        self._line = line_of(bus)
        self._sequence = self._unanswered = 0
        self._armed = False
        self._restarted: JointResetError | None = None

    def open(self) -> None:
        """Identify the joint and open a session.

        Raises:
            CommunicationError: There is no answer, or none that can be decoded.
            WrongJointError: Another joint answers.
            NotSupportedError: The joint speaks a newer protocol.
        """
        self.close()
        self._clock.sleep_until(self.timing.quiet_until)
        try:
            self.hello = identify(self._bus, self._clock, self._joint, self._address, TRIES)
        except CommunicationError as error:
            raise named_error(
                self._joint, self._address, Register.HELLO, error, TRIES, self._held
            ) from error
        self.original = self.hello is None
        if self.hello is None:
            self._open_v1()
            return
        require_known(self.hello, self._joint, self._number, self._address)
        try:
            self._arm(self.hello)
        except BioscaraError:
            self.close()
            raise

    def close(self) -> None:
        """Forget the joint; nothing is sent."""
        self.version, self.hello, self._restarted = 0, None, None
        # The end of the joint's pause outlives the session, the rest does not.
        self.timing.in_position_mode = self.timing.silent = False
        self.timing.stopped_at = math.inf
        self.flags, self._armed = int(_POWER_UP), False

    def require_open(self) -> None:
        """Raise unless the session is open.

        Raises:
            NotInitializedError: It was never opened, or closed.
            JointResetError: The joint restarted since.
        """
        if self._restarted is not None:
            # Each raise would add its frames to those of all cycles before.
            raise self._restarted.with_traceback(None)
        if self.version == 0:
            raise NotInitializedError(f"{self._joint}: call init() first", self._joint)

    def require_v2(self, what: str) -> None:
        """Raise unless the joint speaks version 2.

        Raises:
            NotSupportedError: It does not.
        """
        self.require_open()
        if self.version < 2:
            raise NotSupportedError(f"{self._joint}: {what} needs {FIRMWARE}")

    def start_bootloader(self) -> None:
        """Make a disabled joint leave its firmware for the bootloader in ROM; ends the session.

        It stops answering until it is flashed or its power is cycled.

        Raises:
            NotSupportedError: Its firmware has no such request.
            IncorrectStateError: It is enabled.
            CommunicationError: It did not answer, or refused the request.
        """
        self.require_v2("the request for the bootloader")
        if self.hello is None or not self.hello.starts_bootloader:
            raise NotSupportedError(f"{self._joint}: its firmware does not start its bootloader")
        if not self.flags & Flags.NOTENABLED:
            raise IncorrectStateError(
                f"{self._joint}: it is enabled, and its load may fall", self._joint, "disable() it"
            )
        boot_id = self.hello.boot_id
        # Its answers no longer show a session, which does not mean a restart.
        self._armed = False
        try:
            self.write(Register.DISARM, boot_id)
            self.write(Register.BOOTLOADER, boot_id)
        finally:
            self.close()

    def read(self, register: Register) -> Answer:
        """Read ``register``; raises as :meth:`exchange`, and if it cannot be read."""
        return self.exchange(self._message(READ, register, "read"))

    def write(self, register: Register, *values: float, repeat: bool = True) -> Answer:
        """Write ``register``; raises as :meth:`exchange`, and if it cannot be written."""
        return self.exchange(self._message(WRITE, register, "written"), values, repeat=repeat)

    def exchange(
        self, message: Message, values: Sequence[float] = (), *, repeat: bool = True
    ) -> Answer:
        """Carry out one exchange, with repetitions.

        Args:
            message: Message to send.
            values: Its payload, in the units of the wire.
            repeat: False for commands that must not be executed twice; version 2 joints ensure that
                themselves.

        Raises:
            CommunicationError: The last try failed, or the joint refused the frame.
            JointError: The joint refused because of its state.
            NotSupportedError: The joint's firmware does not know the register.
        """
        self.require_open()
        if self.version == 1 and message.definition.support is not Support.YES:
            self.require_v2(message.register.name)
        if self.version == 1 and message is WRITE.get(message.register):
            self._await_check()
        tries = TRIES if repeat or self.version == 2 else 1
        transaction: Transaction | None = None
        unanswered = False
        # The time between two tries is too short for a joint to be switched on in between.
        asleep = self.timing.silent
        for remaining in reversed(range(tries)):
            try:
                if asleep:
                    self.listens()
                    asleep = False
                if transaction is None:
                    # Not between two tries of one frame: it would be executed under two numbers.
                    if self._unanswered >= _OUT_OF_STEP:
                        self._rejoin()
                    transaction = self.frame(message, values)
                answer = self.take(message, self._transfer(message, transaction))
            except CommunicationError as error:
                problem: BioscaraError = error
                unanswered = True
            else:
                if not answer.flags & _REFUSED:
                    return answer
                if unanswered and remaining:
                    # An earlier try may have been executed. Sending the same frame again shows it;
                    # asking for the reason takes a sequence number and would make that impossible.
                    problem = CorruptFrameError("the repetition was refused", self._address)
                else:
                    problem = self.refusal(message)
                    transaction = None
            if not remaining or not exchange_failed(problem):
                raise named_error(
                    self._joint, self._address, message.register, problem, tries, self._held
                ) from problem
            self.retries += 1
            self._wait(TICK_PAUSE if isinstance(problem, RefusedError) else _PAUSE)
        raise AssertionError  # pragma: no cover - the last round returns or raises

    def frame(self, message: Message, values: Sequence[float] = ()) -> Transaction:
        """Return the next frame, with a sequence number of its own."""
        if self.version == 1:
            self.timing.sending(message, values)
            return Transaction(self._address, message.encode_v1(values), message.answer_size)
        self._sequence = sequence = (self._sequence + 1) & 0xFF
        self._unanswered += 1
        # Transaction(...) takes twice as long.
        return _new(
            Transaction,
            (
                self._address,
                message.encode_v2(self._address, sequence, values),
                message.sealed_answer_size,
            ),
        )

    def take(self, message: Message, result: bytes | CommunicationError) -> Answer:
        """Return the answer to the last frame; REFUSED in its flags is left to the caller.

        Raises:
            CommunicationError: There is none, or it is broken.
            JointResetError: The joint has forgotten the session, so it restarted.
        """
        if not isinstance(result, bytes):
            self._line.failed(self._address, result, self._clock.now())
            if self.version == 1 and isinstance(result, NoAcknowledgeError):
                # It may have lost its power, and regain it.
                self.timing.silent = True
                note_silence(self._bus, self._address)
            raise result
        self._line.in_a_row = 0
        if self.version == 1:
            if self.timing.silent:
                self.timing.silent = False
                forget_silence(self._bus, self._address)
            answer = message.decode_v1(result)
            self.timing.answered(message, answer.flags, self._clock.now())
            self.flags = answer.flags
        else:
            answer = message.decode_v2(self._address, self._sequence, result)
            self.flags = flags = answer[1]
            if self._armed and not flags & _ARMED:
                raise self._forgotten()
            if not flags & _REFUSED:
                self._unanswered = 0
        return answer

    def refusal(self, message: Message) -> BioscaraError:
        """Request the reason of the last refusal; return it, or the error of that request."""
        if message is _FAULT:
            # A read is only refused when it arrived broken.
            return CorruptFrameError("the request arrived corrupted", self._address)
        try:
            report = FaultReport.from_answer(self.exchange(_FAULT))
        except (CommunicationError, JointError) as error:
            return error
        if report.refusal in _FORGOTTEN:
            return self._forgotten()
        return refused_error(self._joint, self._address, message.register, report)

    @property
    def reports_load(self) -> bool:
        """Whether the joint's firmware reports the load in answers to setpoints."""
        return self.hello is not None and self.hello.reports_load

    @property
    def paused(self) -> bool:
        """Whether the joint is in a pause now; an exchange would wait for its end."""
        return self._clock.now() < self.timing.quiet_until

    def listens(self) -> bool:
        """Return whether an exchange would not wait.

        A version 1 joint that did not acknowledge may have been switched on since. Only its
        acknowledge is checked, and nothing is sent to it for a second once it acknowledges.

        Raises:
            NoAcknowledgeError: It still does not.
            CommunicationError: The bus does not work.
        """
        if self.timing.silent:
            if not acknowledges(self._bus, self._clock, self._address):
                raise NoAcknowledgeError("no device acknowledged", self._address)
            self.timing.silent = False
            forget_silence(self._bus, self._address)
            self.timing.quiet_until = self._clock.now() + START_UP
        return not self.paused

    def expect_restart(self) -> None:
        """Check the acknowledge before the next exchange: the joint may be switched on by then.

        Only version 1 needs that, see :meth:`listens`.
        """
        if self.version == 1:
            self.timing.silent = True
            note_silence(self._bus, self._address)

    def stop(self, mode: int) -> None:
        """Write STOP; raises as :meth:`exchange`.

        The original firmware's STOP leaves the setpoint of SETRPM to its deadman, which disables
        the joint after 60 ms of silence; SETRPM 0 resets it, and also ramps down. As every command,
        both wait for the end of an orientation check.
        """
        if self.version == 1:
            # Must never prevent STOP.
            with suppress(CommunicationError, JointError):
                self.write(Register.SETRPM, 0.0, repeat=False)
        self.write(Register.STOP, mode)

    @property
    def _held(self) -> bool:
        """Whether a joint with original firmware may hold the clock, as one read while it starts.

        It does so until its power is switched off. Those in position mode move on.
        """
        return self.original and self._line.in_a_row >= TRIES

    def _await_check(self) -> None:
        """Wait for the end of an orientation check of a version 1 joint, up to its time limit."""
        while self._clock.now() < self.timing.check_until:
            if not self.exchange(_PING).flags & Flags.BUSY:
                return
            self._wait(_CHECK_PAUSE)

    def _message(
        self, messages: Mapping[Register, Message], register: Register, use: str
    ) -> Message:
        """Return the message that uses a register.

        Raises:
            InvalidArgumentError: It has no such use; names the other one.
        """
        message = messages.get(register)
        if message is not None:
            return message
        if not isinstance(register, Register):
            known = "give one of bioscara.protocol.Register"
            raise InvalidArgumentError(f"{self._joint}: no register {shown(register)}; {known}")
        remedy = "it is never sent"
        if register in READ:
            remedy = f"read it: session.read(Register.{register.name})"
        elif register in WRITE:
            written = WRITE[register].definition.written
            values = "".join(f", {field.name}" for field in written if not field.padding)
            remedy = f"write it: session.write(Register.{register.name}{values})"
        raise InvalidArgumentError(
            f"{self._joint}: register {register.name} ({register:#04x}) cannot be {use}; {remedy}"
        )

    def _transfer(self, message: Message, transaction: Transaction) -> bytes | CommunicationError:
        if self.version == 2:
            return self._bus.transfer((transaction,))[0]
        self._clock.sleep_until(self.timing.free_from(message))
        try:
            return self._bus.transfer((transaction,))[0]
        finally:
            self.timing.sent(message, self._clock.now())

    def _open_v1(self) -> None:
        self.version = 1
        try:
            flags = self.exchange(_PING).flags
            if flags & Flags.BUSY or not flags & Flags.NOTENABLED:
                # A command of an earlier host that is no longer supervised. Its motion would
                # continue: to its target, or, in velocity mode, for as long as the joint is polled.
                if flags & Flags.BUSY and not flags & Flags.NOTHOMED:
                    # Not HOME, which clears the home: probably an orientation check.
                    self.timing.check_until = self._clock.now() + CHECK_MOST
                self.stop(1)
        except BioscaraError:
            self.close()
            raise

    def _arm(self, hello: Hello) -> None:
        self.version, self._unanswered = 2, 0
        number = int(self._clock.now() * 1e6) & 0xFFFF
        for remaining in reversed(range(TRIES)):
            try:
                self.write(Register.ARM, hello.boot_id, number)
                self._wait(TICK_PAUSE)
                self._armed = True
                self.write(Register.WATCHDOG, WATCHDOG_MS)
            except CommunicationError:
                # An earlier host may have used this number: the joint opens no session twice, and
                # in one still open its sequence continues, so that all our frames count as old.
                if not remaining:
                    raise
                self._armed = False
                number = (number + 1) & 0xFFFF
            else:
                return

    def _rejoin(self) -> None:
        """Reopen the session with a joint that was unreachable for long and did not restart."""
        before, now = self.hello, identify(self._bus, self._clock, self._joint, self._address, 1)
        if before is None or now is None or now.boot_id != before.boot_id:
            raise self._forgotten()
        try:
            self._arm(now)
        except BioscaraError:
            self._unanswered = _OUT_OF_STEP
            raise

    def _forgotten(self) -> JointResetError:
        """Return why the joint does not know this session; this remains until it is reopened."""
        before, self._armed = self.hello, False
        now = None
        with suppress(CommunicationError, WrongJointError):
            now = identify(self._bus, self._clock, self._joint, self._address, TRIES)
            if before is not None and now is not None and now.boot_id != before.boot_id:
                self._release()
        cause = f"reset cause {now.reset_cause.name}" if now else "no reset cause was reported"
        if now and before and now.boot_id == before.boot_id:
            cause = "its boot id is the same, so another host may have taken it"
        self._restarted = JointResetError(
            f"{self._joint}: the joint restarted ({cause}); its home is lost",
            self._joint,
            "init(), enable() and home() it again",
            now.reset_cause.name if now else "",
        )
        return self._restarted

    def _release(self) -> None:
        """Release a joint that restarted and was engaged since, by the SETUP that found it so.

        It took that without a session, so it takes this, too; it ramps down first.
        """
        self._unanswered = 0
        if not self.exchange(_PING).flags & Flags.NOTENABLED:
            self.write(Register.SETCURRENT, 0)

    def _wait(self, seconds: float) -> None:
        self._clock.sleep_until(self._clock.now() + seconds)
