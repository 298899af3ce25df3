"""The processes of a program that a test has started, by their names."""

from __future__ import annotations

import subprocess
from pathlib import Path


def members(process: subprocess.Popen[str], name: str) -> set[int]:
    """Return the processes of a name in the group of a program."""
    found = set()
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            pid, _, rest = path.read_text().partition(" (")
        except OSError:
            continue
        comm, _, fields = rest.rpartition(") ")
        state, _, group = fields.split()[:3]
        if comm == name and int(group) == process.pid and state != "Z":
            found.add(int(pid))
    return found


def only(process: subprocess.Popen[str], name: str) -> int:
    """Return the only process of that name."""
    (pid,) = members(process, name)
    return pid
