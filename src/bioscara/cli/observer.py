"""Shows and records a motion in a thread of its own.

Neither a slow disk nor a slow terminal may hold up the loop that feeds the joints.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from typing import Self

from bioscara.cli.live_view import View
from bioscara.report import CycleRecord, History
from bioscara.report.samples import SampleWriter

_SWITCH_INTERVAL = 0.5e-3
"""How long a thread keeps the interpreter when another wants it [s]; the default of 5 ms would
make the loop late by half a period whenever a picture is drawn."""


class Observer:
    """Takes cycles from the loop, keeps them, writes them and shows them.

    Usable as a context manager; leaving it waits until everything taken is written.

    Args:
        view: Shows them.
        samples: Writes them.
        history: Keeps them; complete once the observer is closed.

    Attributes:
        problem: Why not all samples were written; empty if they were.
    """

    def __init__(self, view: View, samples: SampleWriter, history: History) -> None:
        self._view, self._samples, self._history = view, samples, history
        self._queue: SimpleQueue[Callable[[], None] | CycleRecord | None] = SimpleQueue()
        self._executor = ThreadPoolExecutor(1, "observer")
        self.problem = ""

    def __enter__(self) -> Self:
        self._switch_interval = sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH_INTERVAL)
        self._work = self._executor.submit(self._observe)
        return self

    def __exit__(self, *_: object) -> None:
        self._queue.put(None)
        self._executor.shutdown()
        sys.setswitchinterval(self._switch_interval)
        self._work.result()

    def cycle(self, record: CycleRecord) -> None:
        """Take a cycle; returns at once."""
        self._queue.put(record)

    def phase(self, text: str) -> None:
        """Say that another part of the run begins; returns at once."""
        self._queue.put(lambda: self._view.phase(text))

    def note(self, text: str) -> None:
        """Say something; returns at once."""
        self._queue.put(lambda: self._view.note(text))

    def _observe(self) -> None:
        while (item := self._queue.get()) is not None:
            if isinstance(item, CycleRecord):
                self._history.append(item)
                self._record(item)
                self._view.cycle(item)
            else:
                item()
        self._view.close()

    def _record(self, record: CycleRecord) -> None:
        if self.problem:
            return
        try:
            self._samples.write((record,))
        except OSError as error:
            self.problem = (
                f"samples end {record.start:.2f} s after the start of the run: "
                f"{error.strerror or error}"
            )
            self._view.note(f"recording stopped, the motion goes on: {error.strerror or error}")
