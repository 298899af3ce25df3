"""Fault injection: a bus that forwards transactions to another one and corrupts some of them.

The terms are PX4's: *off* (``off``, ``unavailable``), *stuck* (``stuck``), *garbage*
(``garbage``, ``flip``, ``noise``, ``truncate``), *wrong* (``swap``), *slow* (``slow``), *delayed*
(``delay``, ``repeat``, ``replay``), and *intermittent*: any of them with a
:class:`~bioscara.bus.injection.When`. ``lose`` drops frames in one direction.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Sequence
from functools import partial

from bioscara.bus.bus import ADDRESSES, Bus, Transaction
from bioscara.bus.injection import ALWAYS, Carry, Direction, Effect, Injection, Result, When
from bioscara.clock import Clock
from bioscara.errors import (
    BusStuckError,
    BusTimeoutError,
    BusUnavailableError,
    InvalidArgumentError,
    LimitError,
    NoAcknowledgeError,
)

_HISTORY = 64
"""Number of frames that can be replayed."""


class FaultyBus(Bus):
    """Wrapper of another bus that injects faults.

    Each method puts one fault in force and returns it; several act together, the last one
    nearest to the host. Without faults, transfers pass unchanged. The same seed and the same calls
    corrupt the same transactions identically.

    Args:
        bus: The bus that carries the remaining transactions; closed with this one.
        seed: Seed of all random numbers.
        clock: Clock of :meth:`slow` and of a ``timeout``; needed for these only.
    """

    def __init__(self, bus: Bus, seed: int, clock: Clock | None = None) -> None:
        self._bus, self._clock = bus, clock
        self._chance = random.Random(seed)  # noqa: S311
        self._injections: list[Injection] = []
        self._history: deque[Transaction] = deque(maxlen=_HISTORY)
        self._late: list[tuple[int, Transaction]] = []
        self._carried = 0
        self._unavailable = 0

    def transfer(self, transactions: Sequence[Transaction]) -> list[Result]:
        """Carry out ``transactions`` as far as the faults let them.

        Raises:
            BusUnavailableError: The other bus raised it, or :meth:`unavailable` is in force.
        """
        if self._unavailable:
            self._unavailable -= 1
            raise BusUnavailableError("injected fault: the adapter is gone")
        if not self._injections:
            self._history.extend(transactions)
            return self._bus.transfer(transactions)
        results: list[Result] = []
        for transaction in transactions:
            try:
                results.append(self._through(transaction))
            except BusUnavailableError as error:
                if not results:
                    raise
                results.append(error)
        return results

    def close(self) -> None:
        """End all faults and close the other bus."""
        self.clear()
        self._bus.close()

    def clear(self) -> None:
        """End all faults."""
        self._injections.clear()
        self._late.clear()
        self._unavailable = 0

    def off(self, when: When = ALWAYS) -> Injection:
        """Inject: no device acknowledges and nothing is delivered."""

        def effect(transaction: Transaction, _: Carry) -> Result:
            return _no_acknowledge(transaction.address)

        return self._inject(effect, when)

    def stuck(
        self, when: When = ALWAYS, *, recognised: bool = True, timeout: float = 0.0
    ) -> Injection:
        """Inject: nothing is delivered because a line is held low.

        Args:
            when: Transactions that it hits.
            recognised: Whether the bus reports it (BusStuckError) or only timeouts.
            timeout: Time that each transaction takes [s].

        Raises:
            InvalidArgumentError: They take time, and the bus was made without a clock.
        """
        kind = BusStuckError if recognised else BusTimeoutError
        clock = self._clock
        if timeout and clock is None:
            raise InvalidArgumentError("a timeout needs a clock: FaultyBus(bus, seed, clock)")

        def effect(transaction: Transaction, _: Carry) -> Result:
            if timeout and clock is not None:
                clock.sleep_until(clock.now() + timeout)
            return kind("injected fault: a line is held low", transaction.address)

        return self._inject(effect, when)

    def unavailable(self, transfers: int) -> None:
        """Inject: the bus as a whole cannot be used for this many transfers."""
        self._unavailable = transfers

    def lose(self, direction: Direction, when: When = ALWAYS) -> Injection:
        """Inject a lost frame: OUT before the joint gets it, BACK after the joint acted on it."""

        def effect(transaction: Transaction, onward: Carry) -> Result:
            if direction is Direction.BACK:
                onward(transaction)
            return BusTimeoutError(
                f"injected fault: the frame {direction.value} was lost", transaction.address
            )

        return self._inject(effect, when)

    def flip(
        self, direction: Direction, when: When = ALWAYS, *, bits: int = 1, bit: int | None = None
    ) -> Injection:
        """Inject bit errors during the transfer.

        OUT counts the 7 address bits first, then the bytes written; BACK the bytes read; each
        from its most significant bit, as they pass on the wire. A changed address sends the write
        to the device with that address; the read still goes to the right one.

        Args:
            direction: Direction of the corrupted frame.
            when: Transactions that it hits.
            bits: Number of different bits that change, chosen at random.
            bit: Change this one bit instead.
        """
        if bits < 1:
            raise InvalidArgumentError(f"flip of {bits} bits: at least 1 changes")

        def effect(transaction: Transaction, onward: Carry) -> Result:
            if direction is Direction.BACK:
                result = onward(transaction)
                return self._flipped(result, bits, bit) if isinstance(result, bytes) else result
            return self._misdirected(transaction, onward, bits, bit)

        return self._inject(effect, when)

    def noise(self, rate: float, when: When = ALWAYS) -> Injection:
        """Inject bit errors in both directions, each bit on its own; as :meth:`flip`.

        Args:
            rate: Share of the bits that change, 0 to 1.
            when: Transactions that it hits.

        Raises:
            LimitError: The rate is outside its range.
        """
        if not 0.0 <= rate <= 1.0:
            raise LimitError("rate of flipped bits", rate, 0.0, 1.0, "")

        def effect(transaction: Transaction, onward: Carry) -> Result:
            out = self._errors(rate, 7 + 8 * len(transaction.write))
            result = (
                self._misdirected(transaction, onward, out, None) if out else onward(transaction)
            )
            if not isinstance(result, bytes):
                return result
            back = self._errors(rate, 8 * len(result))
            return self._flipped(result, back, None) if back else result

        return self._inject(effect, when)

    def garbage(self, when: When = ALWAYS) -> Injection:
        """Inject: the joint acts, but its answer is noise of the right length."""

        def effect(transaction: Transaction, onward: Carry) -> Result:
            result = onward(transaction)
            return self._chance.randbytes(len(result)) if isinstance(result, bytes) else result

        return self._inject(effect, when)

    def truncate(self, keep: int, when: When = ALWAYS, *, filled: bool = True) -> Injection:
        """Inject: the joint acts, but its answer is cut to the first ``keep`` bytes.

        Args:
            keep: Number of bytes that are kept.
            when: Transactions that it hits.
            filled: Whether the rest reads as 0xFF, as on a real bus, or is missing.
        """

        def effect(transaction: Transaction, onward: Carry) -> Result:
            result = onward(transaction)
            if not isinstance(result, bytes):
                return result
            rest = b"\xff" * (len(result) - keep) if filled else b""
            return result[:keep] + rest

        return self._inject(effect, when)

    def swap(self, first: int, second: int, when: When = ALWAYS) -> Injection:
        """Inject: two joints have each other's address."""
        other = {first: second, second: first}

        def effect(transaction: Transaction, onward: Carry) -> Result:
            address, write, read = transaction
            return onward(Transaction(other.get(address, address), write, read))

        return self._inject(effect, when)

    def slow(self, delay: float, when: When = ALWAYS, *, timeout: float = 0.010) -> Injection:
        """Inject a delay of each transaction.

        Args:
            delay: Additional duration [s].
            when: Transactions that it hits.
            timeout: The adapter's timeout [s]; a longer delay ends there, undelivered.

        Raises:
            InvalidArgumentError: The bus was made without a clock.
        """
        clock = self._clock
        if clock is None:
            raise InvalidArgumentError("a slow bus needs a clock: FaultyBus(bus, seed, clock)")

        def effect(transaction: Transaction, onward: Carry) -> Result:
            clock.sleep_until(clock.now() + min(delay, timeout))
            if delay > timeout:
                return BusTimeoutError(
                    "injected fault: the transfer did not end in time", transaction.address
                )
            return onward(transaction)

        return self._inject(effect, when)

    def delay(self, transactions: int, when: When = ALWAYS) -> Injection:
        """Inject a timeout; the frame is delivered late, after ``transactions`` others."""

        def effect(transaction: Transaction, _: Carry) -> Result:
            self._late.append((self._carried + transactions, transaction))
            return BusTimeoutError("injected fault: the frame is late", transaction.address)

        return self._inject(effect, when)

    def repeat(self, times: int = 1, when: When = ALWAYS) -> Injection:
        """Inject ``times`` repetitions of a frame, right after it; the first answer counts."""

        def effect(transaction: Transaction, onward: Carry) -> Result:
            result = onward(transaction)
            for _ in range(times):
                onward(transaction)
            return result

        return self._inject(effect, when)

    def replay(self, frames: int, when: When = ALWAYS) -> Injection:
        """Replay the last ``frames`` frames to any device, with this one, oldest first."""
        if not 0 < frames <= _HISTORY:
            raise LimitError("replayed frames", frames, 1, _HISTORY, "")

        def effect(transaction: Transaction, onward: Carry) -> Result:
            result = onward(transaction)
            for earlier in list(self._history)[-frames:]:
                self._bus.transfer([earlier])
            return result

        return self._inject(effect, when)

    def _inject(self, effect: Effect, when: When) -> Injection:
        injection = Injection(effect, when, self._chance)
        self._injections.append(injection)
        return injection

    def _through(self, transaction: Transaction) -> Result:
        onward: Carry = self._deliver
        for injection in self._injections:
            onward = partial(injection.carry, onward=onward)
        result = onward(transaction)
        due = [late for late in self._late if late[0] <= self._carried]
        self._carried += 1
        for late in due:
            self._late.remove(late)
            self._deliver(late[1])
        return result

    def _deliver(self, transaction: Transaction) -> Result:
        self._history.append(transaction)
        return self._bus.transfer([transaction])[0]

    def _errors(self, rate: float, bits: int) -> int:
        """Return how many of some bits change."""
        return sum(self._chance.random() < rate for _ in range(bits))

    def _misdirected(
        self, transaction: Transaction, onward: Carry, bits: int, bit: int | None
    ) -> Result:
        address, write, read = transaction
        # Seven bits are the address; the eighth states the direction and is kept.
        frame = self._flipped(bytes((address,)) + write, bits, bit, skip=1)
        if frame[0] == address:
            return onward(Transaction(address, frame[1:], read))
        if frame[0] not in ADDRESSES:
            return _no_acknowledge(address)
        if not write:
            return onward(Transaction(frame[0], b"", read))
        written = onward(Transaction(frame[0], frame[1:], 0))
        if read and isinstance(written, bytes):
            return onward(Transaction(address, b"", read))
        return written

    def _flipped(self, frame: bytes, bits: int, bit: int | None, skip: int = 0) -> bytes:
        size = 8 * len(frame) - skip
        if bit is not None and not 0 <= bit < size:
            raise InvalidArgumentError(f"flip of bit {bit}: this frame has bits 0 .. {size - 1}")
        chosen = [bit] if bit is not None else self._chance.sample(range(size), min(bits, size))
        flipped = int.from_bytes(frame, "big")
        for index in chosen:
            flipped ^= 1 << (size - 1 - index)
        return flipped.to_bytes(len(frame), "big")


def _no_acknowledge(address: int) -> NoAcknowledgeError:
    return NoAcknowledgeError("injected fault: no device acknowledged", address)
