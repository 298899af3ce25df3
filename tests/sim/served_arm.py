"""A simulated arm behind a socket, served by a thread in real time that the test controls."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from bioscara.bus import Transaction
from bioscara.sim import SimulatedArm, serve

LIMIT = 10.0
"""Time after which a condition that is waited for counts as never met [s]."""


class ManualClock:
    """Real time that passes only when a test says so."""

    def __init__(self) -> None:
        self.time = 100.0

    def now(self) -> float:
        return self.time

    def sleep_until(self, deadline: float) -> None:
        self.time = max(self.time, deadline)


class HeldArm(SimulatedArm):
    """Lets the test act while a transfer is underway."""

    during: Callable[[], None] = staticmethod(lambda: None)
    transferred = 0

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | int]:
        self.transferred += len(transactions)
        self.during()
        return super().transfer(transactions)


@contextlib.contextmanager
def serving(path: Path, clock: ManualClock | None = None, **options: Any) -> Iterator[HeldArm]:
    """Serve an arm, made with these options, behind a path."""
    arm, ended, listening = HeldArm(**options), threading.Event(), threading.Event()
    thread = threading.Thread(
        target=serve, args=(arm, path, ended.is_set, clock), kwargs={"listening": listening.set}
    )
    thread.start()
    try:
        assert listening.wait(LIMIT)
        yield arm
    finally:
        ended.set()
        thread.join(LIMIT)
        assert not thread.is_alive()
        assert not path.exists()
