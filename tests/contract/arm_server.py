"""The far end of the pretended I2C device: serves a bus to ``i2c_shim.c`` over a Unix socket.

A request is address, count of bytes written and count of bytes to read (16 bits each, native
order) and the bytes written; the answer is an errno (8 bits) and, if that is 0, the bytes read.
"""

from __future__ import annotations

import errno
import struct
from pathlib import Path
from socketserver import StreamRequestHandler, ThreadingUnixStreamServer
from threading import Lock, Thread
from typing import Self

from bioscara.bus import Bus, Transaction
from bioscara.errors import CommunicationError, NoAcknowledgeError

_HEAD = struct.Struct("=HHH")


class ArmServer:
    """Serves ``bus`` on ``path`` while its ``with`` block lasts.

    Args:
        bus: The bus with the arm on it; may be replaced while serving.
        path: Where the socket is created.
    """

    def __init__(self, bus: Bus, path: Path) -> None:
        self.bus, self.path = bus, path
        self._lock = Lock()
        arm = self

        class Handler(StreamRequestHandler):
            def handle(self) -> None:
                while len(head := self.rfile.read(_HEAD.size)) == _HEAD.size:
                    address, written, read = _HEAD.unpack(head)
                    transaction = Transaction(address, self.rfile.read(written), read)
                    self.wfile.write(arm.carry(transaction))

        self._server = ThreadingUnixStreamServer(str(path), Handler)
        self._server.daemon_threads = True
        self._server.block_on_close = False

    def carry(self, transaction: Transaction) -> bytes:
        """Carry out ``transaction`` and return the answer to the shim."""
        with self._lock:
            (result,) = self.bus.transfer([transaction])
        if isinstance(result, bytes):
            return b"\0" + result
        return bytes((_errno(result),))

    def __enter__(self) -> Self:
        Thread(target=self._server.serve_forever, args=(0.05,), daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()
        self.bus.close()


def _errno(error: CommunicationError) -> int:
    return errno.EREMOTEIO if isinstance(error, NoAcknowledgeError) else errno.ETIMEDOUT
