"""First exchange with an address: identifies the joint and its protocol version.

A joint of version 1 answers HELLO, which it does not know, with only its flags, and holds the
clock of the whole bus low when more is read than it answers. So one byte is read first, and the
rest only from a joint that sent the magic twice: one broken byte may look like it. While it
starts up it acknowledges but cannot answer, so a frame without a read is sent first: if that one is
not acknowledged, a joint that acknowledges later is not addressed for a second.

A joint of version 2 also answers with its flags when a request arrives so broken that it recognises
neither register nor trailer. If mistaken for version 1, it would be driven without check bytes, so
the evidence must be strong: many such answers, each followed by an intact PING, no other answer
among them, and no answer of version 2 on this bus before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from weakref import WeakKeyDictionary

from bioscara.bus import ADDRESSES, Bus, Transaction
from bioscara.clock import Clock
from bioscara.drivers.link.joint_reports import Hello
from bioscara.drivers.link.line import line_of
from bioscara.drivers.link.original import QUIET, START_UP, forget_silence, note_silence, was_silent
from bioscara.errors import (
    CommunicationError,
    CorruptFrameError,
    NoAcknowledgeError,
    NotSupportedError,
    WrongJointError,
)
from bioscara.protocol import MAGIC, PROTOCOL, READ, Flags, Register
from bioscara.version import __version__

_V1_ANSWERS = 12
"""Answers of version 1 to HELLO, with a PING after each, that identify a joint as version 1. Bits
that flip in every request make a version 2 joint give such an answer in one of three cases."""
_NEVER_V1 = 0xF0
"""Bits that version 1 never sets in the flags, its only answer to an unknown register."""
_MAGIC_FIRST = MAGIC & 0xFF
_HELLO, _PING = READ[Register.HELLO], READ[Register.PING]
_ACKNOWLEDGE = ord("O")
_MAGIC_TIMES = 2
"""Times that a joint not known to speak version 2 must send the magic before more is read."""

_version_2: WeakKeyDictionary[Bus, set[int]] = WeakKeyDictionary()
"""Addresses at which a joint answered as version 2, by bus; for the life of the bus object."""


def identify(bus: Bus, clock: Clock, joint: str, address: int, tries: int) -> Hello | None:
    """Return the identity of the joint at ``address``; None for a joint of version 1.

    HELLO is accepted with any sequence number, so no prior state is needed.

    Args:
        bus: The bus.
        clock: Time of that bus.
        joint: Name of the expected joint, for messages.
        address: 7-bit address.
        tries: Number of exchanges that may fail.

    Raises:
        CommunicationError: No joint answers, or the answer belongs to neither version, or to
            version 1 where version 2 answered before.
        WrongJointError: The joint accepts only frames sealed for another address.
    """
    lost: CommunicationError | None = None
    corrupt: CorruptFrameError | None = None
    plain, failures, refused = 0, 0, 0
    known = awake = address in _version_2.get(bus, ())
    while failures < tries:
        try:
            if not awake:
                _wake(bus, clock, address)
                awake = True
            first = _first_answer(bus, clock, address, 1 if known else _MAGIC_TIMES)
            if first is None:
                return _read_hello(bus, clock, address, address)
            refused += bool(first & Flags.REFUSED)
            _require_v1_flags(bus, address, first)
            clock.sleep_until(clock.now() + QUIET)
            _require_pong(bus, clock, address)
        except CorruptFrameError as error:
            corrupt = error
        except CommunicationError as error:
            lost = lost or error
            if isinstance(error, NoAcknowledgeError) and not known:
                note_silence(bus, address)
                awake = False
        else:
            plain += 1
            if plain < _V1_ANSWERS:
                continue
            if corrupt is None:
                return None
        failures += 1
        clock.sleep_until(clock.now() + QUIET)
    if refused == tries > 1:
        _raise_if_misaddressed(bus, clock, joint, address)
    raise corrupt or lost or CorruptFrameError("no answer", address)


def await_power_up(
    bus: Bus, clock: Clock, joints: Mapping[str, int], report: Callable[[str], None]
) -> None:
    """Wait if an acknowledge is missing: the joints may have been switched on just now.

    Their original firmware can block the whole bus when it is read from while it starts up. Joints
    that acknowledge at once, or that answered as version 2 before, are not waited for.

    Args:
        bus: The bus.
        clock: Time of that bus.
        joints: Names of the joints and their addresses.
        report: Called with a message before the wait.

    Raises:
        CommunicationError: The bus does not work: a line is held, or it is not there.
    """
    known = _version_2.get(bus, ())
    silent = {
        name: address
        for name, address in joints.items()
        if address not in known and not acknowledges(bus, clock, address)
    }
    if not silent:
        return
    report(
        f"no device acknowledges at the address of {', '.join(silent)}; waiting {START_UP:g} s, in "
        "case the arm was just switched on"
    )
    clock.sleep_until(clock.now() + START_UP)
    awake = [address for address in silent.values() if acknowledges(bus, clock, address)]
    if awake:
        clock.sleep_until(clock.now() + START_UP)
    for address in awake:
        forget_silence(bus, address)


def acknowledges(bus: Bus, clock: Clock, address: int) -> bool:
    """Return whether a frame without a read is acknowledged; records a missing acknowledge.

    Args:
        bus: The bus.
        clock: Time of that bus.
        address: 7-bit address.

    Raises:
        CommunicationError: The bus does not work.
    """
    # Received but not executed, by either version; nothing is read, so nothing can hang.
    try:
        _exchange(bus, clock, Transaction(address, _PING.encode_v1(), 0))
    except NoAcknowledgeError:
        note_silence(bus, address)
        return False
    return True


def require_known(hello: Hello, joint: str, number: int, address: int) -> None:
    """Raise unless ``hello`` is the answer of joint ``number`` of this project.

    Raises:
        NotSupportedError: It speaks a newer protocol.
        WrongJointError: It is another joint.
    """
    if hello.protocol != PROTOCOL:
        raise NotSupportedError(
            f"{joint}: firmware {hello.firmware[0]}.{hello.firmware[1]} speaks protocol "
            f"{hello.protocol}, bioscara {__version__} 1 and {PROTOCOL}; install a bioscara of the "
            f"firmware's version, or flash this one's: bioscara flash --joint {number}"
        )
    if hello.joint != number:
        raise WrongJointError(
            f"{joint}: the joint at {address:#04x} reports that it is j{hello.joint}; correct the "
            f"address, or flash it as what it is: bioscara flash --joint {number}",
            joint,
        )


def _exchange(bus: Bus, clock: Clock, transaction: Transaction) -> bytes:
    result = bus.transfer((transaction,))[0]
    line = line_of(bus)
    if isinstance(result, CommunicationError):
        line.failed(transaction.address, result, clock.now())
        raise result
    line.in_a_row = 0
    return result


def _wake(bus: Bus, clock: Clock, address: int) -> None:
    """Wait until a joint that may just have been switched on can be read from."""
    if not acknowledges(bus, clock, address):
        raise NoAcknowledgeError("no device acknowledged", address)
    if was_silent(bus, address):
        clock.sleep_until(clock.now() + START_UP)
        forget_silence(bus, address)


def _hello(address: int, sealed_for: int, read: int) -> Transaction:
    return Transaction(address, _HELLO.encode_v2(sealed_for, 0), read)


def _first_byte(bus: Bus, clock: Clock, address: int, sealed_for: int) -> int:
    answer = _exchange(bus, clock, _hello(address, sealed_for, 1))
    if len(answer) != 1:
        raise _unknown_answer(address, answer)
    return answer[0]


def _first_answer(bus: Bus, clock: Clock, address: int, times: int) -> int | None:
    """Return the byte answered to HELLO; None if it is the magic ``times`` times."""
    for seen in range(times):
        first = _first_byte(bus, clock, address, address)
        if first != _MAGIC_FIRST:
            if seen:
                raise _unknown_answer(address, bytes((_MAGIC_FIRST, first)))
            return first
        if times > 1:
            # If it is of version 1 after all, it must have time to drop HELLO.
            clock.sleep_until(clock.now() + QUIET)
    return None


def _read_hello(bus: Bus, clock: Clock, address: int, sealed_for: int) -> Hello:
    result = _exchange(bus, clock, _hello(address, sealed_for, _HELLO.sealed_answer_size))
    try:
        answer = _HELLO.decode_v2(sealed_for, 0, result)
    except CorruptFrameError as error:
        raise _unknown_answer(address, result) from error
    if sealed_for == address:
        _version_2.setdefault(bus, set()).add(address)
    if not answer.values or answer.values[0] != MAGIC:
        # The request arrived broken and was refused.
        raise _unknown_answer(address, result)
    return Hello.from_answer(answer)


def _require_v1_flags(bus: Bus, address: int, first: int) -> None:
    if first & _NEVER_V1:
        raise _unknown_answer(address, bytes((first,)))
    if address in _version_2.get(bus, ()):
        raise CorruptFrameError(
            f"answered {first:02x} like a joint of version 1, but answered as version 2 before on "
            "this bus; check the wiring, or end this program if the joint was exchanged",
            address,
        )


def _require_pong(bus: Bus, clock: Clock, address: int) -> None:
    request = Transaction(address, _PING.encode_v1(), _PING.answer_size)
    answer = _PING.decode_v1(_exchange(bus, clock, request))
    if answer.values[0] != _ACKNOWLEDGE:
        raise CorruptFrameError(
            f"answered PING with {int(answer.values[0]):#04x} instead of O; check the wiring",
            address,
        )


def _unknown_answer(address: int, answer: bytes) -> CorruptFrameError:
    return CorruptFrameError(
        f"answered {answer.hex(' ')}, which is neither version's; check the wiring", address
    )


def _raise_if_misaddressed(bus: Bus, clock: Clock, joint: str, address: int) -> None:
    """Raise if the joint at ``address`` takes a HELLO that is sealed for another address."""
    for other in ADDRESSES:
        try:
            if other == address or _first_byte(bus, clock, address, other) != _MAGIC_FIRST:
                continue
            _read_hello(bus, clock, address, other)
        except CommunicationError:
            continue
        raise WrongJointError(
            f"{joint}: the joint that answers at {address:#04x} is the joint of {other:#04x}; "
            "check the wiring and the addresses",
            joint,
        )
