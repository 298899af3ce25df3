"""The first words to an address: who is there, and which version it speaks."""

from __future__ import annotations

from bioscara.bus import ADDRESSES, Bus, Transaction
from bioscara.clock import Clock
from bioscara.drivers.reports import Hello
from bioscara.errors import (
    CommunicationError,
    CorruptFrameError,
    NotSupportedError,
    WrongJointError,
)
from bioscara.protocol import MAGIC, PROTOCOL, READ, TRAILER, Register, crc8

LOOP = 25e-3
"""Existing firmware shows BUSY for an unknown register until its 10 ms loop came by, and forgets
a command if another transaction comes first [s]."""

_NEVER_V1 = 0xF0
"""Bits that version 1 never sets in the flags, which are all it answers to an unknown register."""
_REFUSAL_SIZE = 3
_MESSAGE = READ[Register.HELLO]


def greet(bus: Bus, clock: Clock, joint: str, address: int, tries: int) -> Hello | None:
    """Return who answers at ``address``; None for somebody who does not know HELLO.

    HELLO is accepted with any sequence number, so nothing has to be known beforehand. A version 2
    joint whose answers arrive broken must not pass for a version 1 joint, which is told apart
    from it by its flags.

    Args:
        bus: The bus.
        clock: Time of that bus.
        joint: Who should be there, for messages.
        address: 7-bit address.
        tries: How often to ask.

    Raises:
        CommunicationError: Nobody answers, or what is answered belongs to neither version.
        WrongJointError: Each answer is sealed as that of another address.
    """
    request = Transaction(address, _MESSAGE.encode_v2(address, 0), _MESSAGE.answer_size + TRAILER)
    problem: CommunicationError | None = None
    strange: list[bytes] = []
    plain = 0
    for _ in range(tries):
        result = bus.transfer((request,))[0]
        if isinstance(result, CommunicationError):
            problem = problem or result
        elif (hello := _read(address, result)) is not None:
            return hello
        elif result and not result[0] & _NEVER_V1:
            plain += 1
        else:
            strange.append(result)
        clock.sleep_until(clock.now() + LOOP)
    if plain and not strange:
        return None
    if len(strange) == tries > 1 and len(set(strange)) == 1:
        _raise_if_foreign(joint, address, strange[0])
    if strange:
        raise CorruptFrameError(
            f"answered {strange[-1].hex(' ')}, which is neither version's; check the wiring",
            address,
        )
    raise problem or CorruptFrameError("no answer", address)


def require_known(hello: Hello, joint: str, number: int, address: int) -> None:
    """Raise unless ``hello`` is what joint ``number`` of this project says.

    Raises:
        NotSupportedError: It speaks a newer protocol.
        WrongJointError: It is another joint.
    """
    if hello.protocol != PROTOCOL:
        raise NotSupportedError(
            f"{joint}: firmware {hello.firmware[0]}.{hello.firmware[1]} speaks protocol "
            f"{hello.protocol}, this host 1 and {PROTOCOL}; flash firmware/joint of this host's "
            "version"
        )
    if hello.joint != number:
        raise WrongJointError(
            f"{joint}: the joint at {address:#04x} says that it is j{hello.joint}; flash it with "
            "the right configuration.h or correct the address",
            joint,
        )


def _read(address: int, result: bytes) -> Hello | None:
    try:
        answer = _MESSAGE.decode_v2(address, 0, result)
    except CorruptFrameError:
        return None
    return Hello.from_answer(answer) if answer.values and answer.values[0] == MAGIC else None


def _raise_if_foreign(joint: str, address: int, result: bytes) -> None:
    for other in ADDRESSES:
        seals = (result, result[:_REFUSAL_SIZE])
        if other != address and any(crc8(seal, crc8((other << 1 | 1,))) == 0 for seal in seals):
            raise WrongJointError(
                f"{joint}: whoever answers at {address:#04x} is the joint of {other:#04x}; check "
                "the wiring and the addresses",
                joint,
            )
