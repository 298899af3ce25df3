"""Observation of a simulated arm in a separate process, next to the program that uses it."""

from __future__ import annotations

import socket
from pathlib import Path

from bioscara.errors import BusUnavailableError
from bioscara.sim.framing import ArmState, FrameKind, decode_state, encode_frame, expect, next_frame

_TIMEOUT = 1.0
_SEQUENCES = 2**32
_RECEIVE = 2**12


class Onlooker:
    """Reads the true positions of the arm behind a Unix socket; connects at the first look.

    It is no host: it neither uses the bus nor keeps a host from it.

    Args:
        path: The socket that ``bioscara simulate`` names.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = str(path)
        self._connection: socket.socket | None = None
        self._sequence = 0

    def look(self) -> ArmState:
        """Return the present state.

        Raises:
            BusUnavailableError: No arm answers behind the socket; the next call connects anew.
        """
        try:
            connection = self._connection or self._connect()
            connection.sendall(encode_frame(FrameKind.LOOK, self._sequence))
            state = self._receive(connection)
        except OSError as error:
            self.close()
            raise BusUnavailableError(
                f"no simulated arm behind {self._path} ({error.strerror or error}); "
                f"start it with 'bioscara simulate --socket {self._path}'"
            ) from error
        except BusUnavailableError:
            self.close()
            raise
        self._sequence = (self._sequence + 1) % _SEQUENCES
        return state

    def close(self) -> None:
        """Disconnect; the next look connects anew."""
        if self._connection is not None:
            self._connection.close()
        self._connection = None

    def _connect(self) -> socket.socket:
        self._connection, self._sequence = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM), 0
        self._connection.settimeout(_TIMEOUT)
        self._connection.connect(self._path)
        return self._connection

    def _receive(self, connection: socket.socket) -> ArmState:
        received = bytearray()
        while (frame := next_frame(received)) is None:
            part = connection.recv(_RECEIVE)
            if not part:
                raise ConnectionAbortedError("the other side closed the connection")
            received += part
        if frame.kind is FrameKind.REFUSAL:
            raise BusUnavailableError(
                f"the simulated arm behind {self._path}: {frame.body.decode(errors='replace')}"
            )
        return decode_state(expect(frame, FrameKind.STATE, self._sequence))
