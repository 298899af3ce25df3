"""Facts of the arm that the process of the clients answers without its owner."""

from __future__ import annotations

import asyncio

from bioscara.api import messages as m
from bioscara.server.channel.channel_messages import Known, KnownFaults

_FRESH = 0.25
"""Age of a sample up to which it is the state now [s]; of an older one the owner may be
suspended."""
_CYCLES = 3
"""Cycles after a command from which on samples surely have its effect: one may be made, and one be
sent, while it is carried out."""
_CONTINUOUS = (m.SetJogVelocity, m.RenewLease, m.AddPoints)
"""Commands that change nothing but where the arm will be, and come all the time."""


class KnownState:
    """State, faults and workspace at the end of the last cycle.

    No answer is older than a change that a client has commanded and that was confirmed to it before
    the question: until a sample has its effect, the owner answers.

    Attributes:
        sample: The newest state.
    """

    def __init__(self, sample: m.StateSample) -> None:
        self.sample = sample
        self._loop = asyncio.get_running_loop()
        self._came = self._loop.time()
        self._faults: KnownFaults | None = None
        self._workspace: m.WorkspaceState | None = None
        self._due = 0
        """Cycle from which on samples have the effect of all commands."""

    def take(self, sample: m.StateSample) -> None:
        """Take the state at the end of a cycle."""
        self.sample, self._came = sample, self._loop.time()

    def change(self, known: Known) -> None:
        """Take changed facts."""
        self._faults = known.faults or self._faults
        self._workspace = known.workspace or self._workspace

    def commanded(self, command: m.AnyCommand) -> None:
        """Take it that a command was carried out."""
        if not isinstance(command, _CONTINUOUS):
            self._due = self.sample.cycle + _CYCLES

    def answer(self, session: str, question: m.Query) -> m.AnyResult | None:
        """Return the answer to a question; None if the owner has to give it."""
        if self._loop.time() - self._came > _FRESH or self.sample.cycle < self._due:
            return None
        match question:
            case m.GetState():
                return self.sample
            case m.GetWorkspace():
                return self._workspace
            case m.GetFaults() if self._faults is not None:
                return self._faults.of(session)
        return None
