"""The bytes between a simulated arm's process and its clients.

A request is ``u16 count``, then per transaction ``u8 address, u8 size, u8 read`` and the bytes to
write; the reply is ``u16 count``, then per transaction ``u8 outcome, u8 size`` and the bytes read.
Everything is bounded: at most 64 transactions of at most 255 bytes each way.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Sequence

from bioscara.bus import Transaction
from bioscara.errors import BusUnavailableError, InvalidArgumentError

TRANSACTIONS_MAX = 64
BYTES_MAX = 255
_COUNT = struct.Struct("<H")
_HEAD = struct.Struct("<BBB")
_RESULT = struct.Struct("<BB")


def encode_request(transactions: Sequence[Transaction]) -> bytes:
    """Return the request for ``transactions``.

    Raises:
        InvalidArgumentError: More or larger transactions than a frame carries.
    """
    if len(transactions) > TRANSACTIONS_MAX:
        raise InvalidArgumentError(
            f"{len(transactions)} transactions in one transfer; at most {TRANSACTIONS_MAX}"
        )
    parts = [_COUNT.pack(len(transactions))]
    for address, write, read in transactions:
        if len(write) > BYTES_MAX or not 0 <= read <= BYTES_MAX or not 0 <= address <= 0x7F:
            raise InvalidArgumentError(
                f"transaction with {address:#x}: {len(write)} bytes out, {read} back; an address "
                f"is at most 0x7f and at most {BYTES_MAX} bytes go each way"
            )
        parts.append(_HEAD.pack(address, len(write), read) + write)
    return b"".join(parts)


def receive_request(connection: socket.socket) -> list[Transaction]:
    """Return the next request's transactions.

    Raises:
        BusUnavailableError: The client went away or sent what is no request.
    """
    (count,) = _COUNT.unpack(receive(connection, _COUNT.size))
    if count > TRANSACTIONS_MAX:
        raise BusUnavailableError(f"a client asked for {count} transactions at once")
    transactions = []
    for _ in range(count):
        address, size, read = _HEAD.unpack(receive(connection, _HEAD.size))
        transactions.append(Transaction(address, receive(connection, size), read))
    return transactions


def encode_reply(results: Sequence[bytes | int]) -> bytes:
    """Return the reply that carries ``results``: bytes read, or an outcome number."""
    parts = [_COUNT.pack(len(results))]
    for result in results:
        if isinstance(result, bytes):
            parts.append(_RESULT.pack(0, len(result)) + result)
        else:
            parts.append(_RESULT.pack(result, 0))
    return b"".join(parts)


def receive_reply(connection: socket.socket) -> list[bytes | int]:
    """Return the next reply's results.

    Raises:
        BusUnavailableError: The arm's process went away.
    """
    (count,) = _COUNT.unpack(receive(connection, _COUNT.size))
    results: list[bytes | int] = []
    for _ in range(count):
        outcome, size = _RESULT.unpack(receive(connection, _RESULT.size))
        results.append(outcome or receive(connection, size))
    return results


def receive(connection: socket.socket, size: int) -> bytes:
    """Return exactly ``size`` bytes.

    Raises:
        BusUnavailableError: The other side went away before that.
    """
    parts = []
    while size > 0:
        try:
            part = connection.recv(size)
        except OSError as error:
            raise BusUnavailableError(f"the connection broke: {error.strerror}") from error
        if not part:
            raise BusUnavailableError("the other side closed the connection")
        parts.append(part)
        size -= len(part)
    return b"".join(parts)
