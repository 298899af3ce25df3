"""Bus interface, the only connection between host and joints."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple, Self

from bioscara.errors import CommunicationError

ADDRESSES = range(0x08, 0x78)
"""The 7-bit addresses that devices may have; the others are reserved by the bus."""


class Transaction(NamedTuple):
    """A write to one address and, after a repeated start, a read from it.

    Attributes:
        address: 7-bit address.
        write: The bytes to write; may be empty for a bare read.
        read: Number of bytes to read; 0 for a bare write.
    """

    address: int
    write: bytes
    read: int


class Bus(ABC):
    """A bus that carries transactions to devices.

    Law: ``transfer`` returns one entry per transaction, in order: the bytes read, or the
    :class:`~bioscara.errors.CommunicationError` of this transaction. A failed transaction does not
    prevent the others, and nothing is retried here: only the layer that knows the sequence numbers
    can decide whether a repetition is safe.

    A bus opens at the first transfer; ``close`` is idempotent and ``transfer`` after it
    raises :class:`~bioscara.errors.BusUnavailableError`.
    """

    @abstractmethod
    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        """Carry out ``transactions`` in order.

        Raises:
            BusUnavailableError: The bus as a whole cannot be used; nothing was transferred.
        """

    @abstractmethod
    def close(self) -> None:
        """Release the bus."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
