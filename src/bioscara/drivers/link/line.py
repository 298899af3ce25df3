"""Whether transactions on a bus still end: several joints that time out share one cause.

A joint without power does not acknowledge, which ends a transaction. Only a line that is held low,
or a joint that holds the clock while it is addressed, keeps one from ending.
"""

from __future__ import annotations

import math
from weakref import WeakKeyDictionary

from bioscara.bus import Bus
from bioscara.errors import BusStuckError, BusTimeoutError, CommunicationError


class BusLine:
    """Transactions in a row on one bus that did not end.

    Attributes:
        in_a_row: Their number; set to 0 by an answer.
        since: When the first of them had failed [s].
        first: Address of the first of them.
        addresses: Addresses of all of them.
        stuck: Transactions and re-opened adapters that the bus counted, if it reported for the last
            one that a line is held low; else None.
    """

    __slots__ = ("addresses", "first", "in_a_row", "since", "stuck")

    def __init__(self) -> None:
        self.in_a_row = self.first = 0
        self.since = math.nan
        self.addresses: set[int] = set()
        self.stuck: tuple[int, int] | None = None

    def failed(self, address: int, error: CommunicationError, time: float) -> None:
        """Count a failed transaction, or note that the bus carried it to its end all the same.

        Args:
            address: Address of the device.
            error: Error of the transaction, as the bus reported it.
            time: Now [s].
        """
        if not isinstance(error, BusTimeoutError | BusStuckError):
            self.in_a_row = 0
            return
        if not self.in_a_row:
            self.first, self.since = address, time
            self.addresses.clear()
        self.in_a_row += 1
        self.addresses.add(address)
        # Not the error: by its traceback it would keep the bus alive, to which this belongs.
        self.stuck = None
        if isinstance(error, BusStuckError):
            self.stuck = error.transactions, error.reopened


_lines: WeakKeyDictionary[Bus, BusLine] = WeakKeyDictionary()


def line_of(bus: Bus) -> BusLine:
    """Return the known state of the lines of ``bus``, for the life of that object."""
    line = _lines.get(bus)
    if line is None:
        line = _lines[bus] = BusLine()
    return line
