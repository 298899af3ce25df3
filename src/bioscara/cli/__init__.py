"""The command-line interface: parses the arguments, moves one arm and reports the result.

Begin with ``parser``, whose messages are its own, and ``commands``, of which each has its arguments
and its action in a module. Groups of arguments that commands share are in ``shared_arguments``. The
actions share ``opened_arm``, which opens the named arm, ``motion``, which moves it with a live
display, ``runs`` of files and of the demonstration, ``target``, which plans the motions of ``plan``
and ``move``, ``teach_table`` with the poses of ``--table``, ``owner_link`` to a served arm,
``signals``, ``terminal`` for jogging by keys and for looking at an arm, ``completion`` of words by
the shell, and ``output`` for all that is shown and written.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.cli.parser import parse
from bioscara.errors import BioscaraError, HardwareError
from bioscara.processes.unread_output import finish


def main(arguments: Sequence[str] | None = None, *, paced: bool = True) -> int:
    """Run one command and return its exit status.

    Args:
        arguments: The arguments after ``bioscara``; those of the process by default.
        paced: Whether a simulated trajectory runs in real time; False in tests.
    """
    if sys.stdout is None:
        # Closed by the parent process, as in `bioscara demo >&-`: there is no reader.
        sys.stdout = Path(os.devnull).open("w")  # noqa: SIM115
    if arguments is None and "_ARGCOMPLETE" in os.environ:
        # Imported here: only a shell that completes a command needs it.
        from bioscara.cli.completion import complete  # noqa: PLC0415

        complete()
    options, output = parse(arguments), Output()
    options.paced = paced
    try:
        status = options.run(options, output) or ExitStatus.OK
        finish()
        if status is not ExitStatus.INTERRUPTED:
            output.check()
        sys.stdout.flush()
    except BioscaraError as error:
        complain(str(error))
        for note in getattr(error, "__notes__", ()):
            complain(note)
        status = ExitStatus.FAILED if isinstance(error, HardwareError) else ExitStatus.REFUSED
    except KeyboardInterrupt:
        # Only before or after a motion: during one, Ctrl-C is a request (signals.py).
        complain("interrupted")
        status = ExitStatus.INTERRUPTED
    except OSError as error:
        if not isinstance(error, BrokenPipeError):
            complain(f"the output cannot be written: {error.strerror or error}")
        # Python flushes the remaining output again at exit: it goes to the null device.
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = ExitStatus.FAILED
    return int(status)
