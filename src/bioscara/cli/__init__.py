"""The command-line interface: parses the arguments, moves one arm and reports the result.

Entry points are ``commands``, one module each, and ``arguments``. ``connect`` opens the named arm,
``target`` plans the motions of ``plan`` and ``move``, ``job`` has the common part of ``demo`` and
``run``. ``live_view`` and ``observer`` show and record a motion and never delay it. Modules that
are slow to import are imported only when needed.
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
        arguments: The arguments after ``bioscara``; those of the process by default.
        paced: Whether a simulated trajectory runs in real time; False in tests.
    """
    if sys.stdout is None:
        # Closed by the parent process, as in `bioscara demo >&-`: there is no reader.
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
        # Python flushes the remaining output again at exit: it goes to the null device.
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = Status.FAILED
    return int(status)


def complain(message: str) -> None:
    """Write one line to standard error."""
    with contextlib.suppress(OSError):
        print("bioscara: " + printable(" ".join(message.split())), file=sys.stderr)  # noqa: T201
