"""The uStepper S32: the wiring of chips and controller, and a host on its bus."""

from __future__ import annotations

import itertools
import operator
from pathlib import Path

from bioscara_firmware_sim import Plant

from bioscara.protocol import (
    TRAILER,
    Answer,
    Flags,
    Message,
    Register,
)
from emulator.controller import Controller, Fault as Disturbance, Result
from emulator.gpio import ALTERNATE, INPUT
from emulator.machine import POWER, Machine
from firmware.client import Client

IMAGES = Path(__file__).parents[2] / "firmware" / "build"
HOLD_MOST = 10e-6
"""Longest time for which a joint holds SCL in one write and read, in all [s] (docs/firmware.md)."""
STACK_MOST = 1024
"""Bytes of stack that the firmware uses."""
BOOT_MOST = 0.03
"""From a reset to the first answer [s]."""

_STAT = 0x00
_SOUND = 0x4000


class _Driver:
    """TMC5130 on SPI2, mode 3: datagrams of five bytes between two edges of its select pin."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._answer = b""
        self._sent: bytearray | None = None
        self.datagrams = 0
        self.damage_sent: dict[int, bytes] = {}
        """Bits that flip on their way to the driver, by the number of the datagram."""
        self.damage_received: dict[int, bytes] = {}
        """The same of its answers."""

    def select(self, level: int | None) -> None:
        board = self._board
        if level == 0:
            board.follow()
            self._answer, self._sent = board.plant.driver_answer(), bytearray()
            self._answer = _flipped(self._answer, self.damage_received.get(self.datagrams))
        elif self._sent is not None:
            sent, self._sent = bytes(self._sent), None
            if board.machine.spi2.busy:
                board.machine.violations.append("the driver was deselected inside a byte")
            if len(sent) != 5:
                board.machine.violations.append(f"a datagram of {len(sent)} bytes")
                return
            sent = _flipped(sent, self.damage_sent.get(self.datagrams))
            self.datagrams += 1
            board.follow()
            board.plant.driver_accept(sent)

    def transfer(self, bits: int, sent: int, mode: int, hertz: float) -> int:
        board = self._board
        clocked = board.machine.gpio["A"].alternate(8) == 0 and board.machine.rcc.mco1_hz() == 1e7
        if mode != 3 or bits != 8 or hertz > (5e6 if clocked else 4e6):
            board.machine.violations.append(f"driver: mode {mode}, {bits} bits, {hertz:g} Hz")
        if not clocked:
            board.machine.violations.append("the driver has no clock of 10 MHz")
        if self._sent is None:
            return 0xFF
        self._sent.append(sent)
        index = len(self._sent) - 1
        return self._answer[index] if index < 5 else 0


def _flipped(datagram: bytes, bits: bytes | None) -> bytes:
    return datagram if bits is None else bytes(map(operator.xor, datagram, bits))


class _Encoder:
    """TLE5012B on SPI3, mode 1: a command, then words on the same line in either direction."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._words: list[int] | None = None
        self._answer: list[int] = []

    def select(self, level: int | None) -> None:
        if level == 0:
            self._words = []
        elif self._words is not None:
            words, self._words = self._words, None
            if words and not words[0] & 0x8000:
                self._board.plant.encoder_exchange(words[0], words[1:])

    def transfer(self, bits: int, sent: int, mode: int, hertz: float) -> int:
        board = self._board
        if mode != 1 or bits != 16 or hertz > 8e6:
            board.machine.violations.append(f"encoder: mode {mode}, {bits} bits, {hertz:g} Hz")
        if self._words is None:
            return 0xFFFF
        port = board.machine.gpio["C"]
        driven = port.mode(12) == ALTERNATE
        self._words.append(sent)
        if len(self._words) == 1:
            if not driven:
                board.machine.violations.append("the encoder's command was not driven")
            board.follow()
            self._answer = self._read(sent) if sent & 0x8000 else []
            return sent
        if not self._words[0] & 0x8000:
            return sent
        if driven or port.mode(12) != INPUT:
            board.machine.violations.append("controller and encoder drive one line")
            return sent & (self._answer[0] if self._answer else 0xFFFF)
        return self._answer.pop(0) if self._answer else 0xFFFF

    def _read(self, command: int) -> list[int]:
        board = self._board
        if board.machine.seconds < board.encoder_starts:
            board.encoder_unsound = True
            return []
        answer = board.plant.encoder_exchange(command, [0] * ((command & 15) + 1))
        if board.encoder_unsound and answer:
            answer[-1] &= ~_SOUND
            if command >> 4 & 0x3F == _STAT:
                board.encoder_unsound = False
        return answer


class Board(Client):
    """One joint: controller, chips, mechanics, bus.

    Args:
        joint: 1 to 4.
        hertz: Of the bus.
        seed: Of plant and controller.
        position: Where the joint stands [rad or m].
        encoder_delay: From power-up to the encoder's first answer [s].
    """

    def __init__(
        self,
        joint: int = 4,
        *,
        hertz: int = 400_000,
        seed: int = 1,
        position: float | None = None,
        encoder_delay: float = 0.005,
        lsi: float = 32_000.0,
        image: Path | None = None,
    ) -> None:
        self.joint, self.address = joint, 0x10 + joint
        self.plant = Plant(joint, seed)
        if position is not None:
            self.plant.set_position(position)
        self.encoder_delay, self.encoder_starts, self.encoder_unsound = encoder_delay, 0.0, False
        self.enables: list[tuple[float, bool]] = []
        """When the power stage was closed (true) or opened by the pin."""
        self._sequence = itertools.count(1)
        self.machine = Machine(image or IMAGES / f"j{joint}.elf", seed=seed, lsi=lsi)
        self.driver, self.encoder = _Driver(self), _Encoder(self)
        self.machine.spi2.device, self.machine.spi3.device = self.driver, self.encoder
        ports = self.machine.gpio
        ports["B"].watchers[12] = self.driver.select
        ports["A"].watchers[15] = self.encoder.select
        ports["A"].watchers[1] = self._enable
        self.machine.on_reset.append(self._reset)
        self.bus = Controller(self.machine, hertz)
        self.bus.others = {0x11, 0x12, 0x13, 0x14} - {self.address}
        self._reset(POWER)

    def _reset(self, cause: str) -> None:
        self.follow()
        if cause == POWER:
            self.plant.power_up()
            self.encoder_starts = self.machine.seconds + self.encoder_delay
        # The enable pin floats: its last level stays on the wire.

    def _enable(self, level: int | None) -> None:
        if level is None:
            return
        self.follow()
        self.enables.append((self.machine.seconds, level == 0))
        self.plant.enable(level == 0)

    def follow(self) -> None:
        """Advance the plant to the controller's time."""
        self.plant.advance(max(self.plant.now(), self.machine.seconds))

    def run(self, seconds: float) -> None:
        self.machine.run(seconds)
        self.follow()

    def position(self) -> float:
        self.follow()
        return self.plant.position()

    # The host's side, in version 2 frames.

    def listens(self) -> bool:
        return self.machine.i2c.sda == 1 and self.machine.i2c.enabled

    def boot(self, limit: float = 0.5) -> float:
        """Run until the joint listens; returns how long that took [s]."""
        begun = self.machine.seconds
        while not self.listens() and self.machine.seconds < begun + limit:
            self.machine.run(1e-4)
        assert self.listens(), f"the joint did not start within {limit} s"
        return self.machine.seconds - begun

    def next_sequence(self) -> int:
        return next(self._sequence) & 0xFF

    def frame(self, message: Message, *values: float) -> tuple[bytes, int]:
        sequence = self.next_sequence()
        return message.encode_v2(self.address, sequence, values), sequence

    def exchange(
        self, message: Message, *values: float, fault: Disturbance | None = None
    ) -> tuple[Answer, Result]:
        frame, sequence = self.frame(message, *values)
        size = message.answer_size + TRAILER
        result = self.bus.transfer(self.address, frame, size, fault=fault)
        assert result.data is not None, f"{message} was not answered: {result}"
        return message.decode_v2(self.address, sequence, result.data), result

    def send(self, message: Message, *values: float) -> Answer:
        return self.exchange(message, *values)[0]

    def hello(self) -> tuple[float, ...]:
        return self.read(Register.HELLO)

    def arm(self, session: int = 1) -> None:
        self.write(Register.ARM, self.hello()[5], session)

    def idle(self, limit: float = 30.0) -> Flags:
        """Feed the joint's watchdog until it is not busy."""
        end = self.machine.seconds + limit
        while True:
            self.write(Register.WATCHDOG, 60)
            self.machine.run(0.02)
            flags = self.flags()
            if not flags & Flags.BUSY or self.machine.seconds > end:
                return flags

    def ready(self, percent: int = 20) -> None:
        """Boot, ARM, SETUP and the orientation check that comes with it."""
        self.boot()
        self.arm()
        self.machine.run(0.03)  # The encoder may still be starting.
        self.write(Register.SETUP, percent, percent)
        assert not self.idle() & Flags.NOTENABLED
