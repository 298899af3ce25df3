"""What the process of the clients knows of the arm, and answers without its owner."""

from __future__ import annotations

import asyncio

from bioscara.api import messages as m
from bioscara.server.channel.channel_messages import Known, KnownFaults

_FRESH = 0.25
"""Age of a sample up to which it is the state now [s]; an older one has another cause than the time
between two cycles, which the owner's silence tells."""
_CYCLES = 3
"""Cycles after a command from which on samples surely have its effect: one may be made, and one on
its way, while it is carried out."""


class KnownState:
    """State, faults and workspace at the end of the last cycle.

    A client that commands, or has just done so, reads its own changes: the owner answers it.

    Attributes:
        sample: The newest state.
    """

    def __init__(self, sample: m.StateSample) -> None:
        self.sample = sample
        self._loop = asyncio.get_running_loop()
        self._came = self._loop.time()
        self._faults: KnownFaults | None = None
        self._workspace: m.WorkspaceState | None = None
        self._commanded: dict[str, int] = {}
        """Cycle from which on each client that has commanded reads what is known here."""

    def take(self, sample: m.StateSample) -> None:
        """Take the state at the end of a cycle."""
        self.sample, self._came = sample, self._loop.time()

    def change(self, known: Known) -> None:
        """Take what has changed."""
        self._faults = known.faults or self._faults
        self._workspace = known.workspace or self._workspace

    def commanded(self, session: str) -> None:
        """Take it that a command of a client was carried out."""
        cycle = self.sample.cycle
        self._commanded = {key: due for key, due in self._commanded.items() if due > cycle}
        self._commanded[session] = cycle + _CYCLES

    def answer(self, session: str, question: m.Query) -> m.AnyResult | None:
        """Return the answer to a question; None if the owner has to give it."""
        if self._loop.time() - self._came > _FRESH:
            return None
        if self.sample.cycle < self._commanded.get(session, 0):
            return None
        match question:
            case m.GetState():
                return self.sample
            case m.GetWorkspace():
                return self._workspace
            case m.GetFaults() if self._faults is not None:
                return self._faults.of(session)
        return None
