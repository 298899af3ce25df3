"""Injected faults: the transactions that they hit and their effect."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from bioscara.bus.bus import Transaction
from bioscara.errors import CommunicationError, InvalidArgumentError, LimitError

Result = bytes | CommunicationError
"""Outcome of one transaction."""

Carry = Callable[[Transaction], Result]
"""Carries one transaction through the remaining faults to the bus."""

Effect = Callable[[Transaction, Carry], Result]
"""Applies a fault to one transaction."""


class Direction(Enum):
    """Direction of a frame.

    Attributes:
        OUT: From the host to the joint.
        BACK: From the joint to the host.
    """

    OUT = "out"
    BACK = "back"


@dataclass(frozen=True, slots=True)
class When:
    """Selection of the transactions that a fault hits; by default all.

    Attributes:
        address: Only those to this 7-bit address; None for every address.
        first: Only those with this first byte written; None for every byte.
        probability: Probability of a hit for each of them, 0..1.
        count: Maximum number of hits; None for no limit.
        after: Number of them that first pass unchanged.
    """

    address: int | None = None
    first: int | None = None
    probability: float = 1.0
    count: int | None = None
    after: int = 0

    def __post_init__(self) -> None:
        if not 0.0 <= self.probability <= 1.0:
            raise LimitError("fault probability", self.probability, 0.0, 1.0, "")
        if self.after < 0 or (self.count is not None and self.count < 0):
            raise InvalidArgumentError(
                f"a fault after {self.after} transactions, {self.count} times: "
                f"counts are never negative"
            )

    def matches(self, transaction: Transaction) -> bool:
        """Return whether ``transaction`` is one of those that may be hit."""
        if self.address is not None and self.address != transaction.address:
            return False
        return self.first is None or transaction.write[:1] == bytes((self.first,))


ALWAYS = When()
"""Every transaction."""


class Injection:
    """One fault in force.

    Args:
        effect: Its effect.
        when: Transactions that it hits.
        chance: Source of random numbers.

    Attributes:
        hits: Number of transactions hit so far.
    """

    def __init__(self, effect: Effect, when: When, chance: random.Random) -> None:
        self.hits = 0
        self._effect, self._when, self._chance = effect, when, chance
        self._passed = 0
        self._cancelled = False

    def cancel(self) -> None:
        """End the fault."""
        self._cancelled = True

    def carry(self, transaction: Transaction, onward: Carry) -> Result:
        """Carry ``transaction`` through this fault and, unless dropped there, ``onward``."""
        if not self._hits(transaction):
            return onward(transaction)
        self.hits += 1
        return self._effect(transaction, onward)

    def _hits(self, transaction: Transaction) -> bool:
        when = self._when
        if self._cancelled or not when.matches(transaction):
            return False
        if when.count is not None and self.hits >= when.count:
            return False
        if self._passed < when.after:
            self._passed += 1
            return False
        return self._chance.random() < when.probability
