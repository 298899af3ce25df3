"""File format of bus traces: one line of text per transfer.

    bioscara-bus 1
    12.000125 0.001840 - 11:d500000000:9=0102030405060708ff 12:18:5!NoAcknowledgeError:... *5a17c0de

A record is: start [s], duration [s], then ``-``, or the error that the whole transfer raised, then
its transactions, then a CRC-32 of the line up to the asterisk. A transaction is its address and the
bytes written in hexadecimal, the count of bytes to read, and either ``=`` and the bytes read, or
``!`` and an error: class and percent-encoded message. After a raised error nothing follows the
count.

A record counts once its newline is written, so a file cut at any byte yields every record before
the cut.
"""

from __future__ import annotations

import zlib
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO, NamedTuple
from urllib.parse import quote, unquote

from bioscara.bus.bus import Transaction
from bioscara.errors import (
    BusStuckError,
    BusTimeoutError,
    BusUnavailableError,
    CommunicationError,
    CorruptFrameError,
    InvalidArgumentError,
    NoAcknowledgeError,
    RefusedError,
)

HEADER = b"bioscara-bus 1\n"
"""First line of every trace; the number is the version of the format."""
LINE_MAX = 2**16
"""Longest line that is read [bytes]: a bus call of 42 messages takes some kilobytes."""

_ERRORS: dict[str, type[CommunicationError]] = {
    kind.__name__: kind
    for kind in (
        BusStuckError,
        BusTimeoutError,
        BusUnavailableError,
        CommunicationError,
        CorruptFrameError,
        NoAcknowledgeError,
        RefusedError,
    )
}


class TraceRecord(NamedTuple):
    """One transfer.

    Attributes:
        start: Time of its start [s], by the recorder's clock.
        duration: Its duration [s].
        transactions: The transactions.
        results: The results, one per transaction; empty if ``raised``.
        raised: The error that the transfer raised as a whole, or None.
    """

    start: float
    duration: float
    transactions: tuple[Transaction, ...]
    results: tuple[bytes | CommunicationError, ...]
    raised: CommunicationError | None


def encode_record(
    start: float,
    duration: float,
    transactions: Sequence[Transaction],
    results: Sequence[bytes | CommunicationError],
    raised: CommunicationError | None = None,
) -> bytes:
    """Return the line of one transfer, newline included.

    Args:
        start: When it began [s].
        duration: Its duration [s].
        transactions: The transactions.
        results: The results, one per transaction; ignored if ``raised``.
        raised: The error that the transfer raised as a whole.
    """
    words = [f"{start:.6f} {duration:.6f} {'-' if raised is None else _error_word(raised)}"]
    for index, (address, write, read) in enumerate(transactions):
        request = f"{address:02x}:{write.hex()}:{read}"
        if raised is not None:
            words.append(request)
            continue
        result = results[index]
        if isinstance(result, bytes):
            words.append(f"{request}={result.hex()}")
        else:
            words.append(f"{request}!{_error_word(result)}")
    body = " ".join(words).encode("ascii") + b" "
    return b"%s*%08x\n" % (body, zlib.crc32(body))


def read_trace(path: str | Path) -> Generator[TraceRecord, None, None]:
    """Yield the records of a file, in order; an unfinished last one is left out.

    Args:
        path: The file.

    Raises:
        InvalidArgumentError: The file cannot be read, is no trace of this version, or a
            record in it is damaged; the message names the record.
    """
    try:
        with open(path, "rb") as file:
            yield from _records(_lines(file, str(path)), str(path))
    except OSError as error:
        raise InvalidArgumentError(f"bus trace {path}: {error.strerror}") from error


def _lines(file: BinaryIO, path: str) -> Iterator[bytes]:
    while line := file.readline(LINE_MAX):
        if len(line) == LINE_MAX and not line.endswith(b"\n"):
            raise InvalidArgumentError(f"{path}: a line has more than {LINE_MAX} bytes")
        yield line


def _records(lines: Iterator[bytes], path: str) -> Iterator[TraceRecord]:
    header = next(lines, b"")
    if header != HEADER:
        if HEADER.startswith(header):
            return
        raise InvalidArgumentError(
            f"{path} is no bus trace of this version; "
            f"its first line should be {HEADER.decode().strip()!r}"
        )
    for number, line in enumerate(lines, 1):
        if not line.endswith(b"\n"):
            return
        try:
            yield _decode(line)
        except (ValueError, KeyError) as error:
            raise InvalidArgumentError(
                f"bus trace {path}, record {number} is damaged: {error}"
            ) from error


def _decode(line: bytes) -> TraceRecord:
    body, mark, checksum = line[:-1].rpartition(b"*")
    if not mark or checksum != b"%08x" % zlib.crc32(body):
        raise ValueError("its checksum does not fit")
    start, duration, outcome, *words = body.decode("ascii").split()
    transactions = []
    results: list[bytes | CommunicationError] = []
    for word in words:
        request, answered, answer = word.partition("=")
        request, failed, failure = request.partition("!")
        address, write, read = request.split(":")
        transactions.append(Transaction(int(address, 16), bytes.fromhex(write), int(read)))
        if answered:
            results.append(bytes.fromhex(answer))
        elif failed:
            results.append(_error(failure, int(address, 16)))
    raised = None if outcome == "-" else _error(outcome, None)
    return TraceRecord(float(start), float(duration), tuple(transactions), tuple(results), raised)


def _error_word(error: CommunicationError) -> str:
    name = type(error).__name__
    if name not in _ERRORS:
        name = CommunicationError.__name__
    return f"{name}:{quote(str(error), safe='/', errors='replace')}"


def _error(word: str, address: int | None) -> CommunicationError:
    name, _, message = word.partition(":")
    return _ERRORS[name](unquote(message), address)
