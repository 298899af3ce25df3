"""A pipe or terminal whose reader does not read, for the output of a program."""

from __future__ import annotations

import os
import pty
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from programs import wait_until

KINDS = ("pipe", "terminal")
_FILLING = b"." * 1023 + b"\n"
_CTRL_S, _CTRL_Q = b"\x13", b"\x11"


class Unread:
    """The output; it is read once :meth:`read` was called.

    Args:
        kind: One of KINDS.

    Attributes:
        written: Descriptor for the program.
    """

    def __init__(self, kind: str = "pipe") -> None:
        self.is_terminal = kind == "terminal"
        self._reader, self.written = pty.openpty() if self.is_terminal else os.pipe()
        self._text = b""
        self._reading = threading.Thread(target=self._read)

    def block(self) -> None:
        """Let each further write wait."""
        if self.is_terminal:
            os.write(self._reader, _CTRL_S)
            return
        # Another description of the pipe: that of the program stays blocking.
        path = f"/proc/self/fd/{self.written}"
        filling = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
        for part in (_FILLING, b"\n"):
            with suppress(BlockingIOError):
                while os.write(filling, part):
                    pass
        os.close(filling)

    def read(self) -> None:
        """Begin to read."""
        if self.is_terminal:
            os.write(self._reader, _CTRL_Q)
        self._reading.start()

    def wait_for(self, pattern: str) -> str:
        """Return the text once it matches a pattern."""
        wait_until(lambda: bool(re.search(pattern, self.text)), pattern)
        return self.text

    @property
    def text(self) -> str:
        """All that was read, without what filled it."""
        return self._text.replace(_FILLING, b"").decode(errors="replace").replace("\r\n", "\n")

    def close(self) -> None:
        """End the reading; also where programs have the other end."""
        if self._reading.ident is None:
            self.read()
        os.write(self.written, b"\0")
        os.close(self.written)
        self._reading.join()
        os.close(self._reader)

    def _read(self) -> None:
        while b"\0" not in self._text:
            self._text += os.read(self._reader, 1 << 16)


@contextmanager
def unread(kind: str = "pipe") -> Iterator[Unread]:
    """Make an output for a block of code."""
    output = Unread(kind)
    try:
        yield output
    finally:
        output.close()
