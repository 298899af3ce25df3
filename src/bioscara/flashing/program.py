"""Running of an external program to its end, with its output."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from bioscara.errors import FlashError

LIMIT = 120.0
"""Longest duration of one run [s]; dfu-util takes about 20 s for 256 KiB."""

_ERROR = re.compile(r"error|fail", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class ProgramResult:
    """Result of a program.

    Attributes:
        program: Name of the program.
        code: Its exit status; negative for the signal that ended it.
        text: Its output, both streams.
    """

    program: str
    code: int
    text: str

    def require_success(self, what: str) -> None:
        """Raise unless the program ended with 0.

        Args:
            what: Description of the failed step, for the message.

        Raises:
            FlashError: The program failed; has the description and the program's error line.
        """
        if self.code != 0:
            raise FlashError(f"{what}: {self.program} ended with {self.code}: {self.error_line()}")

    def error_line(self) -> str:
        """Return the last line about an error, or else the last line."""
        lines = [line.strip() for line in self.text.replace("\r", "\n").split("\n")]
        output = [line for line in lines if line] or ["no output"]
        return next((line for line in reversed(output) if _ERROR.search(line)), output[-1])


def is_installed(program: str) -> bool:
    """Return whether a program of this name is installed."""
    return shutil.which(program) is not None


def run(program: str, *arguments: str, folder: Path | None = None) -> ProgramResult:
    """Run a program and wait for its end; it is killed if Ctrl-C interrupts the wait.

    Args:
        program: Name of the program.
        arguments: Its arguments.
        folder: Its working directory.

    Raises:
        FlashError: The program cannot be started, or does not end in time.
    """
    try:
        with subprocess.Popen(  # noqa: S603 (no shell; the arguments are ours)
            (program, *arguments),
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        ) as process:
            try:
                text, _ = process.communicate(timeout=LIMIT)
            except BaseException:
                # Ctrl-C too: the program must not continue writing after the final message.
                process.kill()
                process.wait()
                raise
    except OSError as error:
        raise FlashError(
            f"{shutil.which(program) or program} cannot be run: {error.strerror or error}; install "
            "it again"
        ) from error
    except subprocess.TimeoutExpired as error:
        raise FlashError(
            f"{program} did not end within {LIMIT:g} s; disconnect the board and try again"
        ) from error
    return ProgramResult(program, process.returncode, text.decode(errors="replace"))
