"""I2C as a target (RM0368, section 18), bit by bit.

Cases that the manual leaves open are decided and stated here: a misplaced STOP sets STOPF in
addition to BERR (``stop_after_error``); the address of a target without ACK sets no ADDR; an unread
transmit register is emptied by START and STOP. Bus errors are seen in the frames of others as well.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import ClassVar

from emulator.cortex import FIRST_INTERRUPT, EmulationError
from emulator.peripheral import Peripheral

_CR1, _CR2, _OAR1, _OAR2, _DR, _SR1, _SR2 = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x18
_PE, _ENGC, _NOSTRETCH, _ACK, _SWRST = 1 << 0, 1 << 6, 1 << 7, 1 << 10, 1 << 15
_ERRORS_ON, _EVENTS_ON, _BUFFERS_ON = 1 << 8, 1 << 9, 1 << 10
ADDR, BTF, STOPF, RXNE, TXE = 1 << 1, 1 << 2, 1 << 4, 1 << 6, 1 << 7
BERR, ARLO, AF, OVR = 1 << 8, 1 << 9, 1 << 10, 1 << 11
_CLEARED_BY_ZERO = 0xDF00
_BUSY, _TRA = 1 << 1, 1 << 2


class Phase(Enum):
    IDLE = "idle"
    ADDRESS = "address"
    RECEIVE = "receive"
    TRANSMIT = "transmit"
    OTHERS = "others"


class I2c(Peripheral):
    """The target. The lines belong to :mod:`emulator.controller`, which calls `start`, `clock`
    and `stop`, reads the driven level from `sda`, and waits while it is `stretching`."""

    plain: ClassVar[dict[int, int]] = dict.fromkeys((_CR1, _CR2, _OAR1, _OAR2, 0x1C, 0x24), 0) | {
        0x20: 2
    }
    half = frozenset({_CR1, _CR2, _OAR1, _OAR2, _DR, _SR1, _SR2, 0x1C, 0x20, 0x24})
    stop_after_error = True
    deaf_after_error = False
    """Whether it answers no address after a bus error until it is reset, as some revisions do."""

    def __init__(self, machine, name: str, event: int, error: int) -> None:
        super().__init__(machine, name)
        self._event, self._error = FIRST_INTERRUPT + event, FIRST_INTERRUPT + error
        self.on_release: Callable[[], None] | None = None
        """Called when the target lets go of SCL."""
        self.busy = False
        self.acknowledged = 0
        """Own addresses acknowledged."""
        self._clear()

    def _clear(self) -> None:
        self._status = 0
        self.phase = Phase.IDLE
        self._transmitting = False
        self._bits, self._shift = 0, 0
        self._unread: int | None = None  # DR as received
        self._unsent: int | None = None  # DR as written
        self._next: int | None = None  # the byte being shifted out, or received behind a full DR
        self._read = 0
        self._last = 0
        self._own = False
        self._deaf = False

    def reset(self) -> None:
        super().reset()
        self._clear()
        self.busy = False
        self._changed()

    # Lines.

    @property
    def enabled(self) -> bool:
        return self.registers[_CR1] & (_PE | _SWRST) == _PE

    @property
    def stretching(self) -> bool:
        """The target holds SCL low."""
        if not self.enabled or self.registers[_CR1] & _NOSTRETCH:
            return False
        if self._status & ADDR:
            return True
        if self.phase is Phase.TRANSMIT and self._bits == 0:
            return self._next is None
        return self.phase is Phase.RECEIVE and bool(self._status & BTF)

    @property
    def sda(self) -> int:
        """Level of SDA that the target drives for the next bit; 1 where it lets go."""
        if not self.enabled:
            return 1
        if self.phase is Phase.TRANSMIT and self._bits < 8 and self._next is not None:
            return self._next >> (7 - self._bits) & 1
        if self._bits == 8:
            if self.phase is Phase.ADDRESS:
                return 0 if self._matches() else 1
            if self.phase is Phase.RECEIVE:
                return 0 if self.registers[_CR1] & _ACK else 1
        return 1

    def _matches(self) -> bool:
        if not self.registers[_CR1] & _ACK or self._deaf:
            return False
        if self.registers[_OAR1] & 1 << 15:
            raise EmulationError("addresses of ten bits are not modelled")
        address = self._shift >> 1
        general = self._shift == 0 and self.registers[_CR1] & _ENGC
        second = self.registers[_OAR2]
        dual = second & 1 and address == second >> 1 & 0x7F
        return address == self.registers[_OAR1] >> 1 & 0x7F or bool(general) or bool(dual)

    def start(self) -> None:
        self.busy = True
        if not self.enabled:
            return
        if self._bits:
            self._flag(BERR)
        self._begin(Phase.ADDRESS)
        self._changed()

    def _begin(self, phase: Phase) -> None:
        self._unsent = None
        self._status &= ~(TXE | BTF)
        self._transmitting = False
        self._next = None
        self.phase = phase
        self._bits, self._shift = 0, 0

    def stop(self) -> None:
        self.busy = False
        if not self.enabled:
            return
        misplaced = self._bits > 0
        own = self._own and self.phase in {Phase.RECEIVE, Phase.TRANSMIT}
        if misplaced:
            self._flag(BERR)
        if own and self.registers[_CR1] & _ACK and (not misplaced or self.stop_after_error):
            self._status |= STOPF
        self._begin(Phase.IDLE)
        self._own = False
        self._changed()

    def clock(self, level: int) -> None:
        """One clock with this level of SDA; at its falling edge."""
        if not self.enabled or self.phase is Phase.IDLE:
            return
        self._bits += 1
        if self._bits <= 8:
            if self.phase is not Phase.TRANSMIT:
                self._shift = (self._shift << 1 | level) & 0xFF
            return
        self._bits = 0
        if self.phase is Phase.ADDRESS:
            self._addressed()
        elif self.phase is Phase.RECEIVE:
            self._received(level)
        elif self.phase is Phase.TRANSMIT:
            self._sent(level)
        self._changed()

    def _addressed(self) -> None:
        if not self._matches():
            self._own = False
            self.phase = Phase.OTHERS
            return
        self.acknowledged += 1
        self._own = True
        self._status |= ADDR
        self._transmitting = bool(self._shift & 1)
        self.phase = Phase.TRANSMIT if self._transmitting else Phase.RECEIVE
        self._unsent = None

    def _received(self, level: int) -> None:
        if level:  # The byte was not acknowledged: no further byte is for this target.
            self.phase = Phase.OTHERS
            self._own = False
        if self._unread is None:
            self._unread = self._shift
            self._status |= RXNE
        elif self.registers[_CR1] & _NOSTRETCH:
            self._flag(OVR)
        else:
            self._next = self._shift
            self._status |= BTF

    def _sent(self, level: int) -> None:
        self._next = None
        if level:
            self._flag(AF)  # TXE stays as it is.
            self.phase = Phase.OTHERS
            self._own = False
        elif self._unsent is not None:
            self._load()
        else:
            self._status |= BTF | TXE

    def _load(self) -> None:
        self._next, self._unsent = self._unsent, None
        self._status |= TXE

    def inject(self, flag: int) -> None:
        """An error caused by noise."""
        if self.enabled:
            self._flag(flag)
            if flag == ARLO:
                self._begin(Phase.IDLE)
                self._own = False
            self._changed()

    def _flag(self, flag: int) -> None:
        self._status |= flag
        self._deaf |= self.deaf_after_error and flag != AF

    # Interrupts.

    def _changed(self) -> None:
        enabled = self.registers[_CR2]
        wanted = ADDR | BTF | STOPF
        if enabled & _BUFFERS_ON:
            wanted |= TXE | RXNE
        event = enabled & _EVENTS_ON and self._status & wanted
        error = enabled & _ERRORS_ON and self._status & (BERR | ARLO | AF | OVR)
        self.machine.cpu.level(self._event, bool(event))
        self.machine.cpu.level(self._error, bool(error))
        if self.on_release is not None and not self.stretching:
            self.on_release()

    # Registers.

    def read(self, offset: int) -> int:
        if offset == _SR1:
            self._read |= self._status
            return self._status
        if offset == _SR2:
            value = (_BUSY if self.busy else 0) | (_TRA if self._transmitting else 0)
            if self._status & ADDR and self._read & ADDR:
                self._status &= ~ADDR
                self._read &= ~ADDR
                if self._transmitting:
                    self._status |= TXE
                self._changed()
            return value
        if offset == _DR:
            return self._read_data()
        return super().read(offset)

    def _read_data(self) -> int:
        if self._unread is None:
            return self._last
        self._last = self._unread
        if self._status & BTF and not self._transmitting:
            if not self._read & BTF:
                raise EmulationError("DR read behind BTF without SR1: the manual forbids it")
            self._status &= ~BTF
            self._read &= ~BTF
            self._unread, self._next = self._next, None
        else:
            self._unread = None
            self._status &= ~RXNE
        self._read &= ~RXNE
        self._changed()
        return self._last

    def write(self, offset: int, value: int) -> None:
        if offset == _DR:
            self._write_data(value & 0xFF)
            return
        if offset == _SR1:
            self._status &= value | ~_CLEARED_BY_ZERO
        elif offset == _SR2:
            return
        elif offset == _CR1:
            self._control(value & 0xBFFB)
        else:
            super().write(offset, value)
        self._changed()

    def _control(self, value: int) -> None:
        if self._status & STOPF and self._read & STOPF:
            self._status &= ~STOPF
        self._read &= ~STOPF
        if value & 1 << 8:
            raise EmulationError("I2C1 as a controller is not modelled")
        was = self.enabled
        if value & _SWRST:
            super().reset()
            self._clear()
            self.busy = False
            self.registers[_CR1] = value & _SWRST
            return
        if not value & _PE:
            value &= ~_ACK
            self._clear()
        elif not was:
            self._clear()
            frequency = self.registers[_CR2] & 63
            if frequency * 1_000_000 != self.machine.rcc.bus_hz(1):
                self.machine.violations.append(f"I2C1: FREQ {frequency} is not APB1's frequency")
            if not self.registers[_OAR1] & 1 << 14:
                self.machine.violations.append("I2C1: bit 14 of OAR1 must be kept at 1")
        self.registers[_CR1] = value

    def _write_data(self, value: int) -> None:
        if not self._transmitting:
            return
        if self._status & BTF:
            if not self._read & BTF:
                raise EmulationError("DR written behind BTF without SR1: the manual forbids it")
            self._status &= ~BTF
            self._read &= ~BTF
        if self._unsent is not None:
            self.machine.violations.append("I2C1: DR was overwritten")
        self._unsent = value
        self._status &= ~TXE
        if self._next is None and self.phase is Phase.TRANSMIT:
            self._load()
        self._changed()
