"""Programs of this package as child processes that end with their parent, however that ends."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Sequence

_SET_DEATH_SIGNAL = 1
"""``PR_SET_PDEATHSIG`` of prctl(2)."""


def child_command(words: Sequence[str]) -> list[str]:
    """Return the command line of ``bioscara`` as a child of this process.

    The child gets SIGTERM when the thread that started it has ended, also by ``kill -9``.

    Args:
        words: Those after ``bioscara``.
    """
    return [sys.executable, "-m", __name__, str(os.getpid()), *words]


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
