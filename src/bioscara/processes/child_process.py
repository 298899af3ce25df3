"""Programs of this package as child processes that end with their parent, however that ends.

A child answers the questions of its parent, which takes one that does not for hung.
"""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress

_SET_DEATH_SIGNAL = 1
"""``PR_SET_PDEATHSIG`` of prctl(2)."""
_QUESTIONS = "BIOSCARA_QUESTIONS"
"""Environment variable with the descriptor on which the parent asks."""


def child_command(words: Sequence[str]) -> list[str]:
    """Return the command line of ``bioscara`` as a child of this process.

    The child gets SIGTERM when the thread that started it has ended, also by ``kill -9``.

    Args:
        words: Those after ``bioscara``.
    """
    return [sys.executable, "-m", __name__, str(os.getpid()), *words]


def asked_at(questions: socket.socket) -> dict[str, str]:
    """Return the environment of a child that is asked at the other end of a socket.

    Args:
        questions: The end of the child, to be inherited.
    """
    return {**os.environ, _QUESTIONS: str(questions.fileno())}


class Questions:
    """The questions of the parent of this process, if it asks any."""

    def __init__(self) -> None:
        # Not inherited by the children of this process.
        file = os.environ.pop(_QUESTIONS, "")
        self._socket = socket.socket(fileno=int(file)) if file else None
        if self._socket is not None:
            self._socket.set_inheritable(False)

    def answer(self) -> None:
        """Answer the questions that have come; called by the loop whose life the answer shows."""
        if self._socket is not None:
            with suppress(OSError):
                self._socket.send(self._socket.recv(64, socket.MSG_DONTWAIT), socket.MSG_DONTWAIT)

    def answer_always(self) -> None:
        """Answer in a thread, in a program whose main thread waits for others."""
        if self._socket is not None:
            threading.Thread(target=self._answer_each, name="questions", daemon=True).start()

    def _answer_each(self) -> None:
        assert self._socket is not None  # noqa: S101  as checked
        with suppress(OSError):
            while question := self._socket.recv(64):
                self._socket.send(question)


def main() -> None:
    """Become ``bioscara`` with the given words, as the child of the given process."""
    parent, *words = sys.argv[1:]
    ctypes.CDLL(None).prctl(_SET_DEATH_SIGNAL, signal.SIGTERM)
    if os.getppid() != int(parent):
        # It has ended before.
        return
    os.execv(sys.executable, [sys.executable, "-m", "bioscara", *words])  # noqa: S606  this program


if __name__ == "__main__":
    main()
