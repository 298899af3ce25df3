"""Finds processes that hang: they do not answer, although they had a processor.

A process that has ended is noticed by the end of its connections. One that is stopped, or waits
for something that never comes, keeps them open. It is asked from time to time, and if it does not
answer, the kernel's account of it says whether it could have.
"""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Callable
from enum import Enum
from pathlib import Path

PERIOD = 0.1
"""Period of the checks of a process, and time from its answer to the next question [s]."""
PATIENCE = 1.0
"""Time without an answer after which a process that is stopped or asleep hangs [s]."""
_PROCESSOR_TIME = 2.0
"""Processor time that a process uses without answering, after which it hangs [s]."""
_BEGIN = 60.0
"""Time in which a process has to answer its first question [s]: it begins with its imports."""
_GAP = 0.5
"""Time between two looks from which on the watching process itself did not run [s]."""
_TICKS = os.sysconf("SC_CLK_TCK")


class Condition(Enum):
    """How a process is."""

    ANSWERS = "answers"
    STARVED = "starved"
    """It does not answer, as other processes have the processors, or as it waits for a disk."""
    HUNG = "hung"
    ENDED = "ended"


class Heartbeat:
    """The questions to a process, and its answers.

    Args:
        pid: The process.
        ask: Sends the process a question, without waiting; the answer is :meth:`answer`.
    """

    def __init__(self, pid: int, ask: Callable[[], object]) -> None:
        self.pid, self._ask = pid, ask
        self._begun = self._waiting = False
        self._looked = time.monotonic()
        self._asked = self._awake = self._used = 0.0

    def answer(self) -> None:
        """The answer to the last question has come."""
        self._begun, self._waiting = True, False

    def look(self) -> Condition:
        """Return how the process is; asks it again if it has answered."""
        now = time.monotonic()
        late, self._looked = now - self._looked > _GAP, now
        try:
            state, used = _account(self.pid)
        except (OSError, ValueError, IndexError):
            return Condition.ENDED
        if state in "ZX":
            return Condition.ENDED
        if not self._waiting:
            # First, as the answer may come at once.
            self._waiting = True
            self._ask()
            late = True
        if late:
            # This process was stopped itself, or the computer slept: the time counts anew.
            self._asked, self._used = now, used
        if late or state not in "TS":
            self._awake = now
        patience = PATIENCE if self._begun else _BEGIN
        if now - self._awake >= patience:
            return Condition.HUNG
        if now - self._asked < patience:
            return Condition.ANSWERS
        return Condition.HUNG if used - self._used >= _PROCESSOR_TIME else Condition.STARVED


async def until_lost(heartbeat: Heartbeat, starved: Callable[[], object]) -> bool:
    """Return when a process hangs, or has ended; return whether it hangs.

    Args:
        heartbeat: Its questions.
        starved: Called when it begins to be starved.
    """
    before = Condition.ANSWERS
    while (condition := heartbeat.look()) not in {Condition.HUNG, Condition.ENDED}:
        if condition is Condition.STARVED and before is not condition:
            starved()
        before = condition
        await asyncio.sleep(PERIOD)
    return condition is Condition.HUNG


def _account(pid: int) -> tuple[str, float]:
    """Return the state of a process, as a letter, and the processor time that it has used [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return fields[0], (int(fields[11]) + int(fields[12])) / _TICKS
