"""The command line: arguments go in, one arm moves, a person reads what happened.

Begin with ``commands``, one module each, and ``arguments``. ``connect`` opens the arm that is
named, ``target`` is where ``plan`` and ``move`` go, ``job`` what ``demo`` and ``run`` have in
common. ``live_view`` and ``observer`` show and record a motion without ever delaying it. Nothing
heavy is imported before it is needed.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from bioscara.cli.arguments import parse
from bioscara.cli.exit_status import Status
from bioscara.errors import BioscaraError, HardwareError
from bioscara.printing import printable


def main(arguments: Sequence[str] | None = None, *, paced: bool = True) -> int:
    """Run one command and return its exit status.

    Args:
        arguments: The words after ``bioscara``; those of the process by default.
        paced: Whether a simulated trajectory takes the time it takes; tests do not wait for it.
    """
    if sys.stdout is None:
        # Closed by who started it, as in `bioscara demo >&-`: nobody reads.
        sys.stdout = Path(os.devnull).open("w")  # noqa: SIM115
    options = parse(arguments)
    options.paced = paced
    try:
        status = options.load_command()(options)
        sys.stdout.flush()
    except BioscaraError as error:
        complain(str(error))
        for note in getattr(error, "__notes__", ()):
            complain(note)
        status = Status.FAILED if isinstance(error, HardwareError) else Status.REFUSED
    except KeyboardInterrupt:
        # Only before or after a motion: during one, Ctrl-C is a request (interruption.py).
        complain("interrupted")
        status = Status.INTERRUPTED
    except OSError as error:
        if not isinstance(error, BrokenPipeError):
            complain(f"the output cannot be written: {error.strerror or error}")
        # Python flushes what is left once more at exit: to nowhere.
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = Status.FAILED
    return int(status)


def complain(message: str) -> None:
    """Write one line to standard error."""
    with contextlib.suppress(OSError):
        print("bioscara: " + printable(" ".join(message.split())), file=sys.stderr)  # noqa: T201
