"""Goals of the owner's controllers that actions wait for."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Iterable

from bioscara.api import messages as m
from bioscara.control.controllers.goal_handle import GoalStatus

_KEPT = 64
"""Ends that are kept until they are waited for."""


class GoalEnds:
    """Ends of goals, by their numbers; used by several threads."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._ended: OrderedDict[int, m.EndedGoal] = OrderedDict()
        self._generation = 0
        self._reason = ""

    @property
    def generation(self) -> int:
        """Number of the owner's run to which goals belong; for :meth:`wait`."""
        return self._generation

    def take(self, ended: Iterable[m.EndedGoal]) -> None:
        """Take the ends in a sample; most were there before."""
        with self._changed:
            for goal in ended:
                self._ended[goal.goal] = goal
            while len(self._ended) > _KEPT:
                self._ended.popitem(last=False)
            self._changed.notify_all()

    def lose(self, reason: str) -> None:
        """End all that are waited for: the owner was lost."""
        with self._changed:
            self._ended.clear()
            self._generation += 1
            self._reason = reason
            self._changed.notify_all()

    def wait(self, number: int, generation: int) -> m.EndedGoal:
        """Return the end of a goal once it has ended; aborted if the owner was lost before."""
        with self._changed:
            self._changed.wait_for(lambda: number in self._ended or generation != self._generation)
            if generation != self._generation:
                return m.EndedGoal(number, "", GoalStatus.ABORTED, -1, self._reason)
            return self._ended[number]
