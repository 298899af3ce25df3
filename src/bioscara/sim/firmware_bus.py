"""The bus to a simulated arm in this process; a transaction takes virtual time."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.bus import Bus, Transaction
from bioscara.errors import (
    BusTimeoutError,
    BusUnavailableError,
    CommunicationError,
    NoAcknowledgeError,
)
from bioscara.sim.simulated_arm import SimulatedArm

_NO_ACKNOWLEDGE = 1


class FirmwareBus(Bus):
    """Carries bytes to the firmware of a simulated arm.

    Args:
        arm: The arm; a new one with default settings if None.
    """

    def __init__(self, arm: SimulatedArm | None = None) -> None:
        self.arm = SimulatedArm() if arm is None else arm
        self._closed = False

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        """Carry out ``transactions`` in order.

        Raises:
            BusUnavailableError: The bus is closed.
        """
        if self._closed:
            raise BusUnavailableError("the simulated bus is closed")
        return [
            result if isinstance(result, bytes) else failure(result, transaction.address)
            for transaction, result in zip(
                transactions, self.arm.transfer(transactions), strict=True
            )
        ]

    def close(self) -> None:
        """Refuse further transfers; the arm keeps running."""
        self._closed = True


def failure(outcome: int, address: int) -> CommunicationError:
    """Return the error for the arm's outcome number."""
    if outcome == _NO_ACKNOWLEDGE:
        return NoAcknowledgeError(f"no device acknowledges address {address:#04x}", address)
    return BusTimeoutError(f"the transfer to {address:#04x} did not end in time", address)
