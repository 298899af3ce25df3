"""Output without a wait for its reader: lines pass a thread, and too many are left out.

A pipe or terminal that is not read, as of a stalled ``ssh``, ``less`` or after Ctrl-S, blocks each
write once it is full, and with it the thread that logs. The descriptors cannot be set not to block:
the shell and other programs share them. So one thread for each stream writes to it and may wait.
"""

from __future__ import annotations

import atexit
import faulthandler
import io
import os
import select
import stat
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_MOST = 256 << 10
"""Longest output that waits until the thread has written what it took before [byte]."""
_PATIENCE = 0.5
"""Time for the reader at the end of the program [s]."""
_PAUSE = 0.01
"""Pause between two looks at what other writers have written [s]: a flood of theirs would take the
processor from the threads that move an arm."""
_AT_ONCE = 64 << 10
"""Bytes that are taken from a pipe in one piece, and longest line from it."""
_STACK = 256 << 10
"""Size of the stack of each thread [byte]: an owner with a priority locks it in memory."""

_outputs: list[_Output] = []
"""Those of this process."""


def never_wait(
    before_threads: Callable[[], object] = lambda: None, *, all_of_c: bool = False
) -> None:
    """Let no thread of this process wait for the reader of standard output or standard error.

    Standard error is that of the code in C and of child processes, too: it becomes a pipe. A crash
    writes the stacks of all threads to what was standard error before. Streams that are not the
    process's own, as in a notebook or a test, stay as they are.

    Args:
        before_threads: Called before threads begin, as for a fork.
        all_of_c: Whether code in C writes to standard output.
    """
    made: list[_Output] = []
    if (stream := sys.__stdout__) is not None and sys.stdout is stream:
        made.append(_Output(stream, piped=all_of_c, strict=True))
        sys.stdout = made[-1].stream
    if (stream := sys.__stderr__) is not None and sys.stderr is stream:
        made.append(_Output(stream, piped=True, strict=False))
        sys.stderr = made[-1].stream
        faulthandler.enable(_not_blocking(made[-1].fileno()))
    before_threads()
    _outputs.extend(made)
    size = threading.stack_size(_STACK)
    loops: list[Callable[[], object]] = [each.write_on for each in made]
    loops.append(partial(_take_on, made))
    for loop in loops:
        threading.Thread(target=loop, name="bioscara-output", daemon=True).start()
    threading.stack_size(size)
    atexit.register(finish)


def note_by(form: Callable[[str], str]) -> None:
    """Set the form in which standard error reports that lines were left out."""
    for output in _outputs:
        if not output.strict:
            output.form = form


def finish() -> None:
    """Wait until all is written; at most 0.5 s in all calls, and only after :func:`never_wait`."""
    global _end  # noqa: PLW0603
    _end = _end or time.monotonic() + _PATIENCE
    for output in _outputs:
        output.finish(_end)


_end = 0.0


class _Output(io.RawIOBase):
    """A standard stream.

    Args:
        stream: The stream that it replaces.
        piped: Whether the descriptor becomes a pipe, for what does not pass ``stream``.
        strict: Whether a failed write is raised by the next one, once.

    Attributes:
        stream: The new stream.
        strict: As given.
        form: Makes a line of the text that reports lines that were left out.
    """

    def __init__(self, stream: TextIO, *, piped: bool, strict: bool) -> None:
        super().__init__()
        self.strict = strict
        self.form: Callable[[str], str] = "note: {}".format
        self._number, self._process = stream.fileno(), os.getpid()
        self._copy = os.dup(self._number)
        self._pipe, self._rest = -1, b""
        if piped:
            self._pipe, write = os.pipe()
            os.set_blocking(self._pipe, False)
            # The description is ours, and that of our children: other programs do not share it.
            os.set_blocking(write, False)
            os.dup2(write, self._number)
            os.close(write)
        self._changed, self._taking = threading.Condition(), threading.Lock()
        self._lines: list[bytes] = []
        self._waiting, self._left_out, self._writing = 0, 0, False
        self._error: OSError | None = None
        buffer: Any = self  # which takes all at once, as a buffer does
        self.stream = io.TextIOWrapper(buffer, stream.encoding, stream.errors, line_buffering=True)

    def writable(self) -> bool:
        """Return that it is."""
        return True

    def isatty(self) -> bool:
        """Return whether the reader is a terminal."""
        return os.isatty(self._copy)

    def fileno(self) -> int:
        """Return the descriptor to which the thread writes."""
        return self._copy

    @property
    def pipe(self) -> int:
        """The end of the pipe from which the output of others is read; -1 without."""
        return self._pipe

    def write(self, data: ReadableBuffer, /) -> int:
        """Take whole lines; never waits.

        Raises:
            OSError: A write has failed, and this stream is strict.
        """
        self.flush()
        lines = bytes(data)
        if os.getpid() == self._process:
            self._put(lines)
        else:
            # A forked child has no thread for it.
            with suppress(OSError):
                os.write(self._number, lines)
        return len(lines)

    def flush(self) -> None:
        """Raise the error of a write that has failed, if this stream is strict; does not wait."""
        error, self._error = self._error, None
        if error is not None:
            raise error

    def take(self) -> None:
        """Take the output of others from the descriptor."""
        with self._taking:
            while self._pipe >= 0:
                try:
                    data = os.read(self._pipe, _AT_ONCE)
                except BlockingIOError:
                    return
                if not data:
                    return
                lines, end, rest = (self._rest + data).rpartition(b"\n")
                if not end and len(rest) >= _AT_ONCE:
                    lines, rest = rest, b""
                self._rest = rest
                self._put(lines + end)

    def write_on(self) -> None:
        """Write all that comes; one thread."""
        while True:
            with self._changed:
                while not (self._lines or self._left_out):
                    self._changed.wait()
                if self._left_out:
                    # They came after all others: none is taken from the first one on until now.
                    text = self.form(
                        f"lines left out here, as the output was not read: {self._left_out}"
                    )
                    self._lines.append(f"{text}\n".encode())
                batch, self._lines = b"".join(self._lines), []
                self._waiting, self._left_out, self._writing = 0, 0, True
            try:
                _write_all(self._copy, batch)
            except OSError as error:
                if self.strict:
                    self._error = error
            with self._changed:
                self._writing = False
                self._changed.notify_all()

    def finish(self, end: float) -> None:
        """Wait until all is written, or for the time ``end``."""
        self.take()
        self._put(self._rest)
        with self._changed:
            self._changed.wait_for(
                lambda: not (self._lines or self._left_out or self._writing),
                max(end - time.monotonic(), 0.0),
            )

    def _put(self, lines: bytes) -> None:
        if not lines:
            return
        with self._changed:
            if self._left_out or self._waiting + len(lines) > _MOST:
                self._left_out += lines.count(b"\n") or 1
            else:
                self._lines.append(lines)
                self._waiting += len(lines)
            self._changed.notify_all()


def _take_on(outputs: Sequence[_Output]) -> None:
    """Take the output of others; one thread."""
    piped = [each for each in outputs if each.pipe >= 0]
    while piped:
        select.select([each.pipe for each in piped], [], [])
        for output in piped:
            output.take()
        time.sleep(_PAUSE)


def _write_all(descriptor: int, lines: bytes) -> None:
    begin = 0
    while begin < len(lines):
        # Several lines at once, but no more than a pipe takes in one piece: it may be that of other
        # writers, too, whose lines would else be in the midst of one.
        end = lines.rfind(b"\n", begin, begin + select.PIPE_BUF) + 1 or begin + select.PIPE_BUF
        try:
            begin += os.write(descriptor, lines[begin:end])
        except BlockingIOError:
            # Another program has set it so, as for the gateway of an owner.
            select.select([], [descriptor], [])


def _not_blocking(descriptor: int) -> int:
    """Return another description of a pipe or terminal, not blocking: a crash must not wait.

    A file stays the same, as its users share its end; likewise what cannot be opened anew.
    """
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        with suppress(OSError):
            way = os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY
            return os.open(f"/proc/self/fd/{descriptor}", way)
    return descriptor
