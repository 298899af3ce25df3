"""Bus to a simulated arm in a separate process."""

from __future__ import annotations

import socket
import threading
from collections.abc import Sequence
from pathlib import Path

from bioscara.bus import Bus, Transaction
from bioscara.clock import MonotonicClock
from bioscara.errors import BusUnavailableError, CommunicationError
from bioscara.processes.forking import in_child
from bioscara.processes.scheduling import ProcessorWait
from bioscara.sim.firmware_bus import failure
from bioscara.sim.framing import (
    TRANSACTIONS_MAX,
    FrameKind,
    decode_reply,
    encode_frame,
    encode_hello,
    encode_request,
    expect,
    next_frame,
)

_TIMEOUT = 2.0
_SEQUENCES = 2**32
_RECEIVE = 2**16


class ServedClock:
    """The arm's time, as its host knows it: real time, less its standstills.

    It stands still while the thread that uses the bus is late because other programs have the
    processors: for the arm such a delay does not take place. A thread that is stopped, or takes
    long itself, is late here too.
    """

    def __init__(self) -> None:
        self._wall, self._processor = MonotonicClock(), ProcessorWait()
        self._user = threading.get_ident()
        self._waited = self._before = self._last = self._starved = 0.0

    def now(self) -> float:
        """Return the arm's time [s]."""
        self._take_wait()
        # Where a wait becomes known only afterwards, time stands, and never goes back.
        self._last = max(self._last, self._wall.now() - self._waited - self._starved)
        return self._last

    def sleep_until(self, deadline: float) -> None:
        """Sleep until ``deadline`` [s]."""
        self._take_wait()
        self._sleep(deadline + self._waited + self._starved)

    def begin_connection(self) -> None:
        """Count the arm's standstills of another connection beyond those of the earlier ones."""
        self._before = self._waited

    def begin_transfer(self) -> tuple[float, float]:
        """Return the real time, and for how long this thread was starved since the last one [s]."""
        self._user = threading.get_ident()
        self._take_wait()
        return self._wall.now(), self._starved

    def end_transfer(self, end: float, waited: float, most: float) -> None:
        """Sleep until the end of a transfer.

        Args:
            end: Real time of its end [s].
            waited: For how long the arm's time has stood still since the connection began [s].
            most: Longest sleep [s].
        """
        self._waited, self._starved = self._before + waited, 0.0
        self._sleep(min(end, self._wall.now() + most))

    def _take_wait(self) -> None:
        """Count the wait for a processor since the last call; in a sleep it did no harm."""
        if threading.get_ident() == self._user:
            self._starved += self._processor.lap()

    def _sleep(self, end: float) -> None:
        """Sleep until a real time [s], and count the wait for a processor beyond it."""
        self._wall.sleep_until(end)
        late = self._wall.now() - end
        if threading.get_ident() == self._user:
            self._starved += min(self._processor.lap(), max(late, 0.0))


class SocketBus(Bus):
    """Carries bytes to the arm behind a Unix socket; connects at the first transfer.

    The arm has one host at a time: it is free for the next once this one is closed or its process
    ended. A transfer that is interrupted, by Ctrl-C or anything else, closes the connection, since
    its reply would answer the next request; whether it was carried out is then unknown. The next
    transfer reconnects, so that a stop still reaches the joints.

    For one thread at a time.

    Args:
        path: The socket that ``bioscara simulate`` names.

    Attributes:
        clock: The arm's time.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = str(path)
        self.clock = ServedClock()
        self._connection: socket.socket | None = None
        self._received = bytearray()
        self._sequence = 0
        self._closed = False
        in_child(self.close)

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        """Carry out ``transactions`` in order.

        Raises:
            BusUnavailableError: The bus is closed, no arm answers behind the socket, or another
                host uses the arm.
            InvalidArgumentError: A larger transaction than a frame carries.
        """
        if self._closed:
            raise BusUnavailableError(f"the bus to {self._path} is closed; make a new one")
        batches = [
            transactions[begin : begin + TRANSACTIONS_MAX]
            for begin in range(0, len(transactions), TRANSACTIONS_MAX)
        ]
        begin, starved = self.clock.begin_transfer()
        requests = [
            # One wait is not reported twice.
            (encode_request(batch, begin, starved if index == 0 else 0.0), len(batch))
            for index, batch in enumerate(batches)
        ]
        try:
            results = self._carry_out(requests)
        except BaseException:
            # Ctrl-C included: the reply that was not read would answer the next request.
            self._release()
            raise
        return [
            result if isinstance(result, bytes) else failure(result, transaction.address)
            for result, transaction in zip(results, transactions, strict=True)
        ]

    def close(self) -> None:
        """Disconnect; the arm keeps running."""
        self._closed = True
        self._release()

    def _carry_out(self, requests: Sequence[tuple[bytes, int]]) -> list[bytes | int]:
        connection = self._connection or self._connect()
        results: list[bytes | int] = []
        end = waited = None
        try:
            for body, count in requests:
                self._sequence = (self._sequence + 1) % _SEQUENCES
                connection.sendall(encode_frame(FrameKind.REQUEST, self._sequence, body))
                reply = self._receive(connection, FrameKind.REPLY)
                part, end, waited = decode_reply(reply, count)
                results += part
        except OSError as error:
            raise BusUnavailableError(
                f"the simulated arm behind {self._path} went away or hangs: {error}; "
                f"start it with 'bioscara simulate --socket {self._path}'"
            ) from error
        if end is not None and waited is not None:
            self.clock.end_transfer(end, waited, _TIMEOUT)
        return results

    def _connect(self) -> socket.socket:
        connection = self._connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        connection.settimeout(_TIMEOUT)
        try:
            connection.connect(self._path)
            self._sequence = 0
            connection.sendall(encode_frame(FrameKind.HELLO, 0, encode_hello()))
            self._receive(connection, FrameKind.WELCOME)
            self.clock.begin_connection()
        except OSError as error:
            raise BusUnavailableError(
                f"no simulated arm behind {self._path} ({error.strerror or error}); "
                f"start it with 'bioscara simulate --socket {self._path}'"
            ) from error
        return connection

    def _receive(self, connection: socket.socket, kind: FrameKind) -> bytes:
        while (frame := next_frame(self._received)) is None:
            part = connection.recv(_RECEIVE)
            if not part:
                raise ConnectionAbortedError("the other side closed the connection")
            self._received += part
        if frame.kind is FrameKind.REFUSAL:
            raise BusUnavailableError(
                f"the simulated arm behind {self._path}: {frame.body.decode(errors='replace')}"
            )
        return expect(frame, kind, self._sequence)

    def _release(self) -> None:
        if self._connection is not None:
            self._connection.close()
        self._connection = None
        self._received.clear()
