"""A bus that records its transactions, and one that replays a trace."""

from __future__ import annotations

import logging
import os
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path

from bioscara.bus.bus import Bus, Transaction
from bioscara.bus.trace import HEADER, encode_record, read_trace
from bioscara.clock import Clock
from bioscara.errors import (
    BusUnavailableError,
    CommunicationError,
    InvalidArgumentError,
    ReplayError,
)

_LOG = logging.getLogger(__name__)


class TracingBus(Bus):
    """Forwards transactions to another bus and records them with their results.

    Each transfer is handed to the operating system, unbuffered, before its results are returned:
    the record outlives this process. It outlives a power cut once the system has written it to
    the disk, which :meth:`sync` waits for.

    Tracing never disturbs the transactions: when the file can no longer be written, this is
    logged once, :attr:`failure` holds the reason, and the transactions continue.

    Args:
        bus: The bus to record; closed with this one.
        path: The file, which must not exist yet; it is created at once.
        clock: Time base of the records.

    Raises:
        InvalidArgumentError: The file exists or cannot be created.
    """

    def __init__(self, bus: Bus, path: str | Path, clock: Clock) -> None:
        self._bus, self._path, self._clock = bus, path, clock
        self._failure: OSError | None = None
        self._file: int | None = None
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        except OSError as error:
            raise InvalidArgumentError(
                f"bus trace {path} cannot be created: {error.strerror}; "
                f"name a new file in a folder that can be written to"
            ) from error
        self._append(HEADER)

    @property
    def failure(self) -> OSError | None:
        """Why the trace ended early, or None."""
        return self._failure

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        """Carry out ``transactions`` on the other bus and record them.

        Raises:
            BusUnavailableError: As the other bus raises it.
        """
        start = self._clock.now()
        try:
            results = self._bus.transfer(transactions)
        except CommunicationError as error:
            self._record(start, transactions, (), error)
            raise
        self._record(start, transactions, results, None)
        return results

    def sync(self) -> None:
        """Wait until all records are on the disk; may take long, so never within a control loop."""
        if self._file is not None:
            try:
                os.fsync(self._file)
            except OSError as error:
                self._end_trace(error)

    def close(self) -> None:
        """Close the other bus and the file."""
        try:
            self._bus.close()
        finally:
            self._close_file()

    def _record(
        self,
        start: float,
        transactions: Sequence[Transaction],
        results: Sequence[bytes | CommunicationError],
        raised: CommunicationError | None,
    ) -> None:
        if self._file is not None:
            duration = self._clock.now() - start
            self._append(encode_record(start, duration, transactions, results, raised))

    def _append(self, line: bytes) -> None:
        if self._file is None:
            return
        try:
            while line:
                line = line[os.write(self._file, line) :]
        except OSError as error:
            self._end_trace(error)

    def _end_trace(self, error: OSError) -> None:
        self._failure = error
        self._close_file()
        _LOG.error("bus trace %s ended early: %s", self._path, error.strerror)

    def _close_file(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            os.close(file)


class ReplayBus(Bus):
    """Answers from a trace, as long as the requests equal those of the recorded run.

    Args:
        path: A file that :class:`TracingBus` wrote; opened at the first transfer.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = path
        self._records = read_trace(path)
        self._count = 0
        self._closed = False

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        """Return the recorded results of these transactions.

        Raises:
            ReplayError: The recorded run sent other transactions, or ended here.
            InvalidArgumentError: The file cannot be read or is damaged.
            BusUnavailableError: The bus is closed, or the recorded transfer raised it.
        """
        if self._closed:
            raise BusUnavailableError(f"replay of {self._path} was closed; make a new bus")
        record = next(self._records, None)
        if record is None:
            raise ReplayError(
                f"trace {self._path} ends after {self._count} records, the replayed run continues",
                self._count + 1,
            )
        self._count += 1
        if tuple(transactions) != record.transactions:
            self._raise_difference(transactions, record.transactions)
        if record.raised is not None:
            raise record.raised
        return list(record.results)

    def close(self) -> None:
        """Close the file."""
        self._closed = True
        self._records.close()

    def _raise_difference(
        self, requested: Sequence[Transaction], recorded: Sequence[Transaction]
    ) -> None:
        for index, (now, then) in enumerate(zip_longest(requested, recorded), 1):
            if now != then:
                raise ReplayError(
                    f"trace {self._path}, record {self._count}, transaction {index} differs: "
                    f"recorded {_describe(then)}, now {_describe(now)}",
                    self._count,
                )


def _describe(transaction: Transaction | None) -> str:
    if transaction is None:
        return "none"
    return (
        f"{transaction.address:#04x} write {transaction.write.hex() or 'nothing'}, "
        f"read {transaction.read}"
    )
