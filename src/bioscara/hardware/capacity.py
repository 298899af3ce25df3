"""How many control cycles per second a bus can carry."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.clock import Clock
from bioscara.drivers import Joint, read_states
from bioscara.protocol import READ, TRAILER, WRITE, Message, Register

_FIXED_BITS, _BITS_PER_BYTE = 30, 9
"""Two addresses with their acknowledge, the register and the conditions; each byte that follows."""
_TRIES = 3
_CYCLES = {
    1: (
        (READ[Register.ANGLEMOVED], READ[Register.GETENCODERRPM]),
        (WRITE[Register.MOVETOANGLE], READ[Register.ANGLEMOVED]),
    ),
    2: ((READ[Register.STATE],), (WRITE[Register.TRACK],)),
}
"""By protocol: the messages of one read of the state, and those of one cycle of control."""


def exchange_time(joints: Sequence[Joint], clock: Clock) -> float:
    """Return how long the bus needs for the setpoints and answers of all joints [s].

    Reads the state of all joints and goes from the length of those frames to that of a cycle's.

    Args:
        joints: Joints that have been greeted.
        clock: Time of their bus.
    """
    taken = []
    for _ in range(_TRIES):
        start = clock.now()
        read_states(joints)
        taken.append(clock.now() - start)
    read = sum(_bits(joint, 0) for joint in joints)
    control = sum(_bits(joint, 1) for joint in joints)
    # The shortest: what else the computer did meanwhile is not the bus's doing.
    return min(taken) * control / read


def _bits(joint: Joint, which: int) -> int:
    trailer = TRAILER if joint.version == 2 else 0
    return sum(_size(message, trailer) for message in _CYCLES[joint.version][which])


def _size(message: Message, trailer: int) -> int:
    written, read = message.request_size - 1 + trailer, message.answer_size + trailer
    return _FIXED_BITS + _BITS_PER_BYTE * (written + read)
