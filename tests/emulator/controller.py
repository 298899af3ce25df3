"""The controller of the bus: the Raspberry Pi's half, and faults on the wires."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field
from enum import Enum

from emulator.clock import SECOND
from emulator.i2c import I2c
from emulator.machine import Machine, Signal

Process = Generator[int | tuple[Signal, int], None, None]


class Trouble(Enum):
    """A fault inside a byte."""

    START = "a START where none belongs; the controller goes on"
    STOP = "a STOP where none belongs; the controller goes on"
    ABORT = "a STOP inside a byte, and nothing more"
    VANISH = "the controller is gone, both lines are released"
    VANISH_LOW = "the controller is gone and holds SCL low for a time"
    SDA_LOW = "something holds SDA low for a time"
    FLIP = "a bit of the controller is the other one, a bit of the target is pulled low"


@dataclass(frozen=True)
class Fault:
    """Where in a transaction the fault occurs.

    Attributes:
        byte: Counted from 0 over the whole transaction, address bytes included.
        bit: How many of the byte's nine clocks come before it.
        seconds: How long lines are held.
    """

    kind: Trouble
    byte: int
    bit: int
    seconds: float = 0.02


@dataclass
class Result:
    """How a transaction went.

    Attributes:
        data: The bytes read; None where an address or a byte was not acknowledged.
        hung: SCL was held for longer than the controller waits.
        holds: Each time that the target held SCL low [s].
        begun, ended: Virtual time [s].
    """

    data: bytes | None = None
    hung: bool = False
    broken: bool = False
    holds: list[float] = field(default_factory=list)
    begun: float = 0.0
    ended: float = 0.0

    @property
    def held(self) -> float:
        return sum(self.holds)


class _HungError(Exception):
    pass


class _BrokenError(Exception):
    pass


class Controller:
    """Puts transactions on the bus.

    Args:
        machine: Whose I2C1 is the target.
        hertz: Frequency of SCL.
        patience: How long SCL may be held before the controller gives up [s].
    """

    def __init__(self, machine: Machine, hertz: int = 400_000, patience: float = 0.035) -> None:
        self.machine = machine
        self.target: I2c = machine.i2c
        self.hertz = hertz
        self.patience = patience
        self.sda = self.scl = 1
        self.others: set[int] = set()
        """Addresses of other targets on the bus; they acknowledge and send zeros."""
        self.others_hold = 0.0
        """How long each of these holds SCL low before it sends [s]."""
        self._released = Signal()
        self._holding, self._fell, self._let_go = False, 0, None
        self._moving: tuple[int, list[int | None]] | None = None
        self.target.on_release = self._note_release
        machine.gpio["B"].inputs[8], machine.gpio["B"].inputs[9] = self._scl, self._sda

    @property
    def bit(self) -> int:
        return SECOND // self.hertz

    def transfer(
        self, address: int, written: bytes, read: int = 0, *, fault: Fault | None = None
    ) -> Result:
        """One transaction while the machine runs: write, repeated START, read, as far as asked."""
        result = self.begin(address, written, read, fault=fault)
        self.machine.run(10.0, until=lambda: result.ended > 0.0)
        return result

    def begin(
        self, address: int, written: bytes, read: int = 0, *, fault: Fault | None = None
    ) -> Result:
        """As `transfer`, without waiting for its end."""
        result = Result()
        self.machine.spawn(self._transaction(result, address, written, read, fault))
        return result

    def _transaction(
        self, result: Result, address: int, written: bytes, read: int, fault: Fault | None
    ) -> Process:
        self._result, self._fault, self._byte = result, fault, 0
        self._foreign = address in self.others
        result.begun = self.machine.seconds
        try:
            yield from self._bytes(result, address, written, read)
        except _HungError:
            result.hung = True
        except _BrokenError:
            result.broken = True
        self.sda = self.scl = 1
        self._moving = None
        result.ended = self.machine.seconds

    def _bytes(self, result: Result, address: int, written: bytes, read: int) -> Process:
        acknowledged = True
        if written or not read:
            yield from self._start()
            for byte in (address << 1, *written):
                acknowledged = not (yield from self._write(byte))
                if not acknowledged:
                    break
        received = bytearray()
        if acknowledged and read:
            yield from self._start()
            acknowledged = not (yield from self._write(address << 1 | 1))
            if self._foreign:
                yield round(self.others_hold * SECOND)
            for index in range(read if acknowledged else 0):
                received.append((yield from self._read(last=index == read - 1)))
        yield from self._stop()
        result.data = bytes(received) if acknowledged else None

    def _start(self) -> Process:
        if self.scl and not self.target.sda:
            raise _BrokenError  # Something holds SDA: no START is possible.
        if not self.scl:
            self.sda = 1
            yield self.bit // 2
            yield from self._release()
            yield self.bit // 2
        self.sda = 0
        self.target.start()
        yield self.bit // 2
        self.scl = 0

    def _stop(self) -> Process:
        self.sda = 0
        yield self.bit // 2
        yield from self._release()
        yield self.bit // 2
        self.sda = 1
        self.target.stop()
        yield self.bit // 2

    def _release(self) -> Process:
        """Let SCL rise; the target may hold it, since its last falling edge."""
        if self.target.stretching:
            yield self._released, round(self.patience * SECOND)
            if self.target.stretching:
                self._result.holds.append((self.machine.now - self._fell) / SECOND)
                raise _HungError
        if self._let_go is not None:
            self._result.holds.append((self._let_go - self._fell) / SECOND)
            self._let_go = None
        self.scl = 1

    def _note_release(self) -> None:
        if self._holding:
            self._holding = False
            self._let_go = self.machine.now
            self._released.fire()

    def _clocks(
        self, levels: list[int | None]
    ) -> Generator[int | tuple[Signal, int], None, list[int]]:
        """Clock bits out (or in, where None); the first may be stretched before."""
        seen: list[int] = []
        yield self.bit // 2
        yield from self._release()
        self._moving = self.machine.now, levels
        yield self.bit * len(levels) - self.bit // 2
        self._moving = None
        for level in levels:
            line = self.target.sda & (1 if level is None else level)
            if level is None and self._foreign:
                line = 0
            seen.append(line)
            self.target.clock(line)
        self.scl, self.sda = 0, 1
        self._fell = self.machine.now
        self._holding = self.target.stretching
        return seen

    def _scl(self) -> int:
        if self.target.stretching:
            return 0
        if self._moving is None:
            return self.scl
        return (self.machine.now - self._moving[0]) // (self.bit // 2) + 1 & 1

    def _sda(self) -> int:
        level: int | None = self.sda
        if self._moving is not None:
            since, levels = self._moving
            level = levels[min((self.machine.now - since) // self.bit, len(levels) - 1)]
            if level is None and self._foreign:
                level = 0
        return self.target.sda & (1 if level is None else level)

    def _frame(
        self, levels: list[int | None]
    ) -> Generator[int | tuple[Signal, int], None, list[int]]:
        """Nine clocks, with the fault where it belongs."""
        fault, here = self._fault, self._byte
        self._byte += 1
        if fault is None or fault.byte != here:
            seen = yield from self._clocks(levels)
            return seen
        if fault.kind is Trouble.FLIP:
            bit = min(fault.bit, len(levels) - 1)
            flipped = 0 if levels[bit] is None else 1 - levels[bit]
            seen = yield from self._clocks([*levels[:bit], flipped, *levels[bit + 1 :]])
            return seen
        seen = []
        if fault.bit:
            seen = yield from self._clocks(levels[: fault.bit])
        yield from self._misbehave(fault)
        if fault.bit < len(levels):
            seen += yield from self._clocks(levels[fault.bit :])
        return seen

    def _misbehave(self, fault: Fault) -> Process:
        held = round(fault.seconds * SECOND)
        yield self.bit // 2
        if fault.kind is not Trouble.VANISH_LOW:
            yield from self._release()
        if fault.kind is Trouble.START:
            self.target.start()
        elif fault.kind is Trouble.STOP:
            self.target.stop()
        elif fault.kind is Trouble.ABORT:
            self.target.stop()
            raise _BrokenError
        elif fault.kind is Trouble.VANISH:
            raise _BrokenError
        elif fault.kind is Trouble.VANISH_LOW:
            self.sda, self.scl = 1, 0
            yield held
            raise _BrokenError
        else:
            # SDA falls while SCL is high, and rises with it high again.
            self.sda = 0
            self.target.start()
            yield held
            self.sda = 1
            self.target.stop()
            raise _BrokenError
        yield self.bit // 2
        self.scl = 0

    def _write(self, byte: int) -> Generator[int | tuple[Signal, int], None, int]:
        levels: list[int | None] = [byte >> 7 - bit & 1 for bit in range(8)]
        seen = yield from self._frame([*levels, None])
        return seen[8]

    def _read(self, *, last: bool) -> Generator[int | tuple[Signal, int], None, int]:
        seen = yield from self._frame([*[None] * 8, 1 if last else 0])
        return int("".join(str(bit) for bit in seen[:8]), 2)

    # Lines as such.

    def hold_sda(self, seconds: float) -> None:
        """Something pulls SDA low for a time while the bus is idle."""
        self.sda = 0
        self.target.start()

        def let_go() -> None:
            self.sda = 1
            self.target.stop()

        self.machine.after(seconds, let_go)

    def recover(self) -> bool:
        """Nine clocks and a STOP, as a controller does that finds SDA low; true if SDA is high."""
        for _ in range(9):
            if self.target.sda:
                break
            self.machine.run(self.bit / SECOND)
            self.target.clock(self.target.sda)
        free = bool(self.target.sda)
        self.target.start()
        self.target.stop()
        return free
