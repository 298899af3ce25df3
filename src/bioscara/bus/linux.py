"""The bus of a Raspberry Pi: Linux i2c-dev, one ioctl per transaction.

One ioctl carries at most one write and one read to one address. The kernel would accept 42
messages, but the Pi 4's controller refuses a read that is not the last message and the Pi 5's
refuses a change of address.
"""

from __future__ import annotations

import ctypes
import math
import os
import struct
from collections.abc import Sequence
from fcntl import LOCK_EX, LOCK_NB, flock, ioctl
from typing import NamedTuple

from bioscara.bus.bus import ADDRESSES, Bus, Transaction
from bioscara.bus.diagnosis import GONE, open_error, transfer_error
from bioscara.bus.user import in_use, locking_user
from bioscara.errors import (
    BusStuckError,
    BusTimeoutError,
    BusUnavailableError,
    CommunicationError,
    InvalidArgumentError,
    LimitError,
    NoAcknowledgeError,
)
from bioscara.processes.forking import in_child

# linux/i2c-dev.h and linux/i2c.h
_I2C_RETRIES = 0x0701
_I2C_TIMEOUT = 0x0702
_I2C_FUNCS = 0x0705
_I2C_RDWR = 0x0707
_I2C_FUNC_I2C = 0x00000001
_I2C_M_RD = 0x0001

MESSAGE_MAX = 32
"""Bytes that the I2C target of a joint accepts or sends in one frame. The kernel would send 8192;
in the original firmware, an excess overwrites its own variables."""

TIMEOUT_STEP = 0.010
"""Resolution of an adapter's timeout in the kernel [s], and thus its minimum."""

STUCK_AFTER = 4
"""Timeouts in a row, of more than one address and with no other outcome between them, after which
the bus counts as stuck."""

_SHAPES_MAX = 1024
"""Number of cached shapes of transactions: some hundred times those of a run."""


class _Message(ctypes.Structure):
    _fields_ = (
        ("address", ctypes.c_uint16),
        ("flags", ctypes.c_uint16),
        ("length", ctypes.c_uint16),
        ("buffer", ctypes.c_void_p),
    )


class _Request(ctypes.Structure):
    _fields_ = (("messages", ctypes.c_void_p), ("count", ctypes.c_uint32))


class _Exchange:
    """The kernel's structures for all transactions of one shape, built once.

    Attributes:
        request: Argument of the ioctl.
        out: The bytes to write; filled before each ioctl.
        back: The bytes that were read.
    """

    __slots__ = ("_kept", "back", "out", "request")

    def __init__(self, address: int, written: int, read: int) -> None:
        self.out, self.back = bytearray(written), bytearray(read)
        views = []
        messages = []
        for flags, buffer in ((0, self.out), (_I2C_M_RD, self.back)):
            if buffer:
                view = (ctypes.c_char * len(buffer)).from_buffer(buffer)
                views.append(view)
                messages.append(_Message(address, flags, len(buffer), ctypes.addressof(view)))
        array = (_Message * len(messages))(*messages)
        self.request = _Request(ctypes.addressof(array), len(messages))
        # The kernel sees bare addresses: their targets must live as long as the request.
        self._kept = (array, views)


class LinuxBusStatistics(NamedTuple):
    """Error counts of a :class:`LinuxBus` since its creation.

    Attributes:
        no_acknowledges: Transactions without an acknowledge.
        timeouts: Transactions that did not end in time.
        other_errors: Transactions that failed otherwise.
        recoveries: Number of times that a stuck bus was re-opened.
    """

    no_acknowledges: int
    timeouts: int
    other_errors: int
    recoveries: int


class LinuxBus(Bus):
    """An I2C adapter of this machine.

    A stuck bus is one on which :data:`STUCK_AFTER` transactions in a row, of more than one address,
    timed out: one joint that is too slow is not a line that is held low. From then on each transfer
    re-opens the adapter and tries one transaction. If that times out too, all are answered with
    :class:`~bioscara.errors.BusStuckError`, so a transfer on a stuck bus takes one adapter timeout,
    not one per joint. Any other outcome ends the condition.

    For one thread at a time, and one program: the first transfer opens the adapter, and no other
    bus of this kind can open it until it is closed.

    Args:
        bus: Number of the bus (1 is the one on the Pi's header) or path of its device.
        timeout: Time after which the kernel aborts a transaction [s]; rounded up to
            :data:`TIMEOUT_STEP`. The kernel keeps one per adapter: it holds for other programs
            too.

    Raises:
        InvalidArgumentError: The number or the timeout cannot be used.
    """

    def __init__(self, bus: int | str, timeout: float = TIMEOUT_STEP) -> None:
        if isinstance(bus, int) and bus < 0:
            raise InvalidArgumentError(f"bus number {bus} is negative; 1 is the one on the header")
        if not 0.0 < timeout <= 1.0:
            raise LimitError("bus timeout", timeout, 0.0, 1.0, "s")
        self._path = f"/dev/i2c-{bus}" if isinstance(bus, int) else bus
        self._timeout_steps = math.ceil(timeout / TIMEOUT_STEP - 1e-9)
        self._device: int | None = None
        self._closed = False
        self._gone = False
        self._exchanges: dict[tuple[int, int, int], _Exchange] = {}
        self._streak = self._reopened = 0
        self._timed_out: set[int] = set()
        self._stuck = False
        self._no_acknowledges = self._timeouts = self._other_errors = self._recoveries = 0
        in_child(self.close)

    def __repr__(self) -> str:
        return f"<LinuxBus {self._path}>"

    @property
    def path(self) -> str:
        """Path of the device."""
        return self._path

    @property
    def timeout(self) -> float:
        """The adapter timeout in force [s]."""
        return self._timeout_steps * TIMEOUT_STEP

    @property
    def statistics(self) -> LinuxBusStatistics:
        """Error counts."""
        return LinuxBusStatistics(
            self._no_acknowledges, self._timeouts, self._other_errors, self._recoveries
        )

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        """Carry out ``transactions`` in order, one ioctl each.

        Raises:
            BusUnavailableError: The bus is closed, or its device cannot be opened.
            InvalidArgumentError: One of them is no transaction; none was carried out.
        """
        exchanges = self._exchanges
        try:
            prepared = [exchanges[item[0], len(item[1]), item[2]] for item in transactions]
        except KeyError:
            prepared = self._prepare(transactions)
        if self._device is None:
            self._open()
        if self._stuck and prepared:
            return self._transfer_stuck(transactions, prepared)
        return self._carry_out(transactions, prepared)

    def close(self) -> None:
        """Release the device."""
        self._closed = True
        self._release()

    def _carry_out(
        self, transactions: Sequence[Transaction], prepared: list[_Exchange]
    ) -> list[bytes | CommunicationError]:
        device = -1 if self._device is None else self._device
        results: list[bytes | CommunicationError] = []
        alive = False
        for transaction, exchange in zip(transactions, prepared, strict=True):
            exchange.out[:] = transaction[1]
            try:
                ioctl(device, _I2C_RDWR, exchange.request)
            except OSError as error:
                failure = self._failure(error, transaction[0])
                results.append(failure)
                alive = alive or not isinstance(failure, BusTimeoutError)
            else:
                alive = True
                results.append(bytes(exchange.back))
        if alive:
            self._streak = self._reopened = 0
            self._timed_out.clear()
        else:
            self._streak += len(results)
            self._timed_out.update(transaction[0] for transaction in transactions)
            self._stuck = self._streak >= STUCK_AFTER and len(self._timed_out) > 1
        if self._gone:
            self._gone = False
            self._release()
        return results

    def _failure(self, error: OSError, address: int) -> CommunicationError:
        failure = transfer_error(error, self._path, address)
        if isinstance(failure, NoAcknowledgeError):
            self._no_acknowledges += 1
        elif isinstance(failure, BusTimeoutError):
            self._timeouts += 1
        else:
            self._other_errors += 1
            self._gone = self._gone or error.errno in GONE
        return failure

    def _transfer_stuck(
        self, transactions: Sequence[Transaction], prepared: list[_Exchange]
    ) -> list[bytes | CommunicationError]:
        self._recoveries += 1
        self._reopened += 1
        self._release()
        self._open()
        self._stuck = False
        results = self._carry_out(transactions[:1], prepared[:1])
        if self._device is None:
            gone = str(results[0])
            return [BusUnavailableError(gone, transaction[0]) for transaction in transactions]
        if not self._stuck:
            return results + self._carry_out(transactions[1:], prepared[1:])
        text = (
            f"{self._path}: {self._streak} transactions in a row timed out and re-opening the "
            f"adapter {self._reopened} times did not help; a joint or a short holds a line low"
        )
        return [
            BusStuckError(
                text,
                transaction[0],
                remedy=BusStuckError.REMEDY,
                transactions=self._streak,
                reopened=self._reopened,
            )
            for transaction in transactions
        ]

    def _prepare(self, transactions: Sequence[Transaction]) -> list[_Exchange]:
        if len(self._exchanges) > _SHAPES_MAX:
            self._exchanges.clear()
        prepared = []
        for address, write, read in transactions:
            shape = address, len(write), read
            if shape not in self._exchanges:
                _check(*shape)
                self._exchanges[shape] = _Exchange(*shape)
            prepared.append(self._exchanges[shape])
        return prepared

    def _open(self) -> None:
        if self._closed:
            raise BusUnavailableError(f"{self._path} was closed; make a new bus")
        try:
            device = os.open(self._path, os.O_RDWR)
        except OSError as error:
            raise open_error(error, self._path) from error
        try:
            flock(device, LOCK_EX | LOCK_NB)
        except OSError as error:
            text = in_use(self._path, locking_user(device), os.getpid())
            os.close(device)
            raise BusUnavailableError(text) from error
        try:
            functions = ioctl(device, _I2C_FUNCS, bytes(struct.calcsize("L")))
            ioctl(device, _I2C_TIMEOUT, self._timeout_steps)
            # Only the layers above know whether a repetition is safe; the kernel must not repeat.
            ioctl(device, _I2C_RETRIES, 0)
        except OSError as error:
            os.close(device)
            raise open_error(error, self._path) from error
        if not struct.unpack("L", functions)[0] & _I2C_FUNC_I2C:
            os.close(device)
            raise BusUnavailableError(
                f"{self._path} carries SMBus commands only, the joints need plain I2C; "
                f"choose another bus, on a Raspberry Pi linux:1"
            )
        self._device = device

    def _release(self) -> None:
        device, self._device = self._device, None
        if device is not None:
            os.close(device)


def _check(address: int, written: int, read: int) -> None:
    if address not in ADDRESSES:
        raise InvalidArgumentError(
            f"bus address {address:#x} is outside {ADDRESSES[0]:#04x} .. {ADDRESSES[-1]:#04x}; "
            f"the joints are 0x11 .. 0x14"
        )
    for count in (written, read):
        if not 0 <= count <= MESSAGE_MAX:
            raise LimitError("size of a message", count, 0, MESSAGE_MAX, "bytes")
    if not (written or read):
        raise InvalidArgumentError(f"transaction with {address:#04x}: neither written nor read")
