"""The other end of a bus under test."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.bus import Bus, Transaction
from bioscara.errors import BusUnavailableError, CommunicationError, NoAcknowledgeError

Result = bytes | CommunicationError
ABSENT = 0x20


class Wire(Bus):
    """Keeps the frames that arrive; each address answers differently, ABSENT does not answer."""

    def __init__(self) -> None:
        self.arrived: list[Transaction] = []
        self.unavailable = False
        self.closed = False

    def transfer(self, transactions: Sequence[Transaction]) -> list[Result]:
        if self.unavailable:
            raise BusUnavailableError("the wire is cut")
        self.arrived.extend(transactions)
        return [
            NoAcknowledgeError("nobody there", t.address)
            if t.address == ABSENT
            else bytes((t.address + 16 * i) & 0xFF for i in range(t.read))
            for t in transactions
        ]

    def close(self) -> None:
        self.closed = True
