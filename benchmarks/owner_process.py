"""An arm that is served in another process, as the benchmarks of the owner's clients use it."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]


class Arm:
    """The arm of :mod:`benchmarks.served_arm`."""

    def __init__(self, program: subprocess.Popen[str]) -> None:
        self._program = program

    def tell(self, word: str) -> None:
        """Send a word to the process."""
        assert self._program.stdin
        self._program.stdin.write(word + "\n")
        self._program.stdin.flush()

    def cycles(self) -> Array:
        """Return a row for each cycle since the mark, as :mod:`benchmarks.served_arm` has it."""
        assert self._program.stdout
        self.tell("cycles")
        return np.array(json.loads(self._program.stdout.readline()))

    def lateness(self, seconds: float, act: Callable[[], object] = lambda: None) -> list[float]:
        """Return how much later than due each cycle ended, against the earliest [s].

        Args:
            seconds: Time for which the cycles are observed.
            act: Called at the begin of that time.
        """
        self.tell("mark")
        act()
        time.sleep(seconds)
        ends = self.cycles()[:, 0]
        late = ends - np.arange(len(ends)) * 0.01
        return list(late - late.min())

    def memory(self) -> int:
        """Return the resident memory of the process [byte]."""
        return memory_of(self._program.pid)


def memory_of(process: int) -> int:
    """Return the resident memory of a process [byte]."""
    text = Path(f"/proc/{process}/status").read_text()
    return 1024 * int(text.split("VmRSS:")[1].split()[0])


@contextmanager
def served(name: str, topic: str = "", speed: float = 1.0) -> Iterator[Arm]:
    """Serve an arm in another process.

    Args:
        name: Name of the owner.
        topic: File for messages of Zenoh, for comparison; empty for none.
        speed: Factor by which its time is faster than real time.
    """
    program = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.served_arm", name, topic, str(speed)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert program.stdin
    assert program.stdout
    try:
        program.stdout.readline()
        yield Arm(program)
        program.stdin.write("end\n")
        program.stdin.flush()
        program.wait(30)
    finally:
        program.kill()
        program.wait()
