"""The first words to an address: who is there, and which version it speaks."""

from __future__ import annotations

from bioscara.bus import Bus, Transaction
from bioscara.clock import Clock
from bioscara.drivers.reports import Hello
from bioscara.errors import CommunicationError, CorruptFrameError
from bioscara.protocol import MAGIC, READ, TRAILER, Register

LOOP = 25e-3
"""Existing firmware shows BUSY for an unknown register until its 10 ms loop came by, and forgets
a command if another transaction comes first [s]."""

_TRIES = 3
_MESSAGE = READ[Register.HELLO]


def greet(bus: Bus, clock: Clock, address: int) -> Hello | None:
    """Return who answers at ``address``; None for somebody who does not know HELLO.

    HELLO is accepted with any sequence number, so nothing has to be known beforehand.

    Raises:
        CommunicationError: Nobody answers.
    """
    request = Transaction(address, _MESSAGE.encode_v2(address, 0), _MESSAGE.answer_size + TRAILER)
    for remaining in reversed(range(_TRIES)):
        result = bus.transfer((request,))[0]
        if isinstance(result, CommunicationError):
            if not remaining:
                raise result
        else:
            try:
                answer = _MESSAGE.decode_v2(address, 0, result)
            except CorruptFrameError:
                pass
            else:
                if answer.values and answer.values[0] == MAGIC:
                    return Hello.from_answer(answer)
        clock.sleep_until(clock.now() + LOOP)
    return None
