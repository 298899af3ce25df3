"""The bus to a simulated arm that lives in a process of its own."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from pathlib import Path

from bioscara.bus import Bus, Transaction
from bioscara.errors import BusUnavailableError, CommunicationError
from bioscara.sim.firmware_bus import failure
from bioscara.sim.framing import TRANSACTIONS_MAX, encode_request, receive_reply

_TIMEOUT = 2.0


class SocketBus(Bus):
    """Carries bytes to the arm behind a Unix socket; connects at the first transfer.

    Args:
        path: The socket that ``bioscara simulate`` names.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = str(path)
        self._connection: socket.socket | None = None
        self._closed = False

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        """Carry out ``transactions`` in order.

        Raises:
            BusUnavailableError: The bus is closed, or no arm answers behind the socket.
            InvalidArgumentError: A larger transaction than a frame carries.
        """
        if self._closed:
            raise BusUnavailableError(f"the bus to {self._path} is closed")
        requests = [
            encode_request(transactions[begin : begin + TRANSACTIONS_MAX])
            for begin in range(0, len(transactions), TRANSACTIONS_MAX)
        ]
        connection = self._connection or self._connect()
        results: list[bytes | int] = []
        try:
            for request in requests:
                connection.sendall(request)
                results += receive_reply(connection)
        except (OSError, BusUnavailableError) as error:
            self._release()
            raise BusUnavailableError(
                f"the simulated arm behind {self._path} went away: {error}; "
                f"start it with 'bioscara simulate --socket {self._path}'"
            ) from error
        return [
            result if isinstance(result, bytes) else failure(result, transaction.address)
            for result, transaction in zip(results, transactions, strict=True)
        ]

    def close(self) -> None:
        """Disconnect; the arm lives on."""
        self._closed = True
        self._release()

    def _connect(self) -> socket.socket:
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        connection.settimeout(_TIMEOUT)
        try:
            connection.connect(self._path)
        except OSError as error:
            connection.close()
            raise BusUnavailableError(
                f"no simulated arm behind {self._path} ({error.strerror or error}); "
                f"start it with 'bioscara simulate --socket {self._path}'"
            ) from error
        self._connection = connection
        return connection

    def _release(self) -> None:
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()
