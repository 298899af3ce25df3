"""The command line: words go in, one arm moves, a person reads what happened.

``arguments`` and ``shared_arguments`` know the words; one module per command does the work:
``demo``, ``run``, ``move``, ``plan``, ``poses``, ``joints``, ``simulate``, ``view``, ``flash``.
``arm`` is the one that is named, ``job`` what ``demo`` and ``run`` have in common, ``target`` where
``plan`` and ``move`` go (``target_checks``), ``taught`` what has a name in the table, ``pictures``
the files that they write. ``views``, ``table`` and ``observer`` show and record a motion without
ever holding it up, ``output`` may go away, ``warned`` and ``latched`` tell what happened,
``interruption`` turns Ctrl-C into a request, ``flashed`` is a joint that is flashed, seen from its
bus, ``status`` is how it ends. Nothing heavy is imported before it is needed.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from bioscara.cli.arguments import parse
from bioscara.cli.status import Status
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
