"""The program that uses a bus, by name and process id: two may not address the joints at once."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import NamedTuple

from bioscara.printing import printable

_PROC = Path("/proc")
_NAME_MAX = 100
"""Characters of a program's name that a message shows."""
_INTERPRETER = re.compile(r"python[0-9.]*")
_LOCK = re.compile(r"\d+: FLOCK +\w+ +WRITE (\d+) ([0-9a-f]+):([0-9a-f]+):(\d+) ")


class User(NamedTuple):
    """A program that uses a bus.

    Attributes:
        pid: Its process id; 0 if unknown, as of a program in another container.
        name: Its name; empty if unknown.
    """

    pid: int
    name: str

    def __str__(self) -> str:
        if not self.pid:
            return "another program"
        return f"{self.name or 'another program'} (pid {self.pid})"


def user_of(pid: int) -> User:
    """Return the program with this process id, with its name as far as the kernel shows it."""
    try:
        words = os.fsdecode((_PROC / str(pid) / "cmdline").read_bytes()).split("\0")
    except OSError:
        words = []
    return User(pid, printable(_name(words))[:_NAME_MAX])


def locking_user(device: int) -> User:
    """Return the program that holds the exclusive ``flock`` of an open file.

    Args:
        device: Descriptor of the file, opened by this program.
    """
    status = os.fstat(device)
    file = os.major(status.st_dev), os.minor(status.st_dev), status.st_ino
    try:
        locks = (_PROC / "locks").read_text()
    except OSError:
        locks = ""
    for pid, major, minor, inode in _LOCK.findall(locks):
        if (int(major, 16), int(minor, 16), int(inode)) == file:
            return user_of(int(pid))
    return User(0, "")


def in_use(bus: str, user: User, pid: int) -> str:
    """Return the message that refuses a bus to a program.

    Args:
        bus: The bus, as the subject of the sentence.
        user: The program that uses it.
        pid: Process id of the refused program.
    """
    reason = "two programs that address the joints at the same time read each other's answers"
    if user.pid == pid:
        return f"{bus} is used by another bus of this program, {user}: {reason}; close that first"
    return f"{bus} is used by {user}: {reason}; end that one first"


def _name(words: list[str]) -> str:
    """Return the name of the program with this command line: the script, not its interpreter."""
    program = Path(words[0]).name if words else ""
    if not _INTERPRETER.fullmatch(program):
        return program
    arguments = iter(words[1:])
    for word in arguments:
        if not word.startswith("-") or word == "-":
            script = Path(word)
            return (script.parent.name if script.name == "__main__.py" else script.name) or program
        if word.startswith("--"):
            continue
        for place, letter in enumerate(word[1:], 2):
            if letter == "c":
                return program
            if letter == "m":
                return word[place:] or next(arguments, program)
            if letter in "WX":
                # The rest of the word is the option's value, or else the next word.
                if not word[place:]:
                    next(arguments, None)
                break
    return program
