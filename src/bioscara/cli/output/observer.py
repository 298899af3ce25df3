"""Display and recording of a motion in a separate thread.

Neither a slow disk nor a slow terminal may delay the control loop.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from typing import Self

from bioscara.cli.output.live_view import View
from bioscara.report import CycleHistory, CycleRecord
from bioscara.report.sample_file import SampleWriter

_SWITCH_INTERVAL = 0.5e-3
"""Switch interval of the interpreter between threads [s]; the default of 5 ms would delay the loop
by half a period at each update of the display."""


class Observer:
    """Receives cycles from the loop, stores them, writes them to a file and displays them.

    Usable as a context manager; leaving it waits until all received cycles are written.

    Args:
        view: Displays the cycles.
        samples: Writes the cycles; None if they are only displayed.
        history: Stores the cycles, if given; complete once the observer is closed.

    Attributes:
        problem: Why not all samples were written; empty if they were.
    """

    def __init__(
        self, view: View, samples: SampleWriter | None = None, history: CycleHistory | None = None
    ) -> None:
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
        """Queue a cycle; returns at once."""
        self._queue.put(record)

    def phase(self, text: str) -> None:
        """Report the begin of another phase of the run; returns at once."""
        self._queue.put(lambda: self._view.phase(text))

    def note(self, text: str) -> None:
        """Print a message; returns at once."""
        self._queue.put(lambda: self._view.note(text))

    def _observe(self) -> None:
        while (item := self._queue.get()) is not None:
            if isinstance(item, CycleRecord):
                if self._history is not None:
                    self._history.append(item)
                self._record(item)
                self._view.cycle(item)
            else:
                item()
        self._view.close()

    def _record(self, record: CycleRecord) -> None:
        if self.problem or self._samples is None:
            return
        try:
            self._samples.write((record,))
        except OSError as error:
            self.problem = (
                f"samples end {record.start:.2f} s after the start of the run: "
                f"{error.strerror or error}"
            )
            self._view.note(f"recording stopped, the motion goes on: {error.strerror or error}")
