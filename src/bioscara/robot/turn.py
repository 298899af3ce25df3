"""Which thread runs the control loop of an arm."""

from __future__ import annotations

import threading
from collections.abc import Callable

from bioscara.processes.scheduling import wake_on_time

_POLL = 0.1
"""Polling period of a thread that waits for its turn, in case it is not notified [s]."""


class Turn:
    """Admits one thread at a time to the control loop.

    A thread gives its turn back by setting ``holder`` to None, if it is itself, and then calls
    :meth:`notify`: in this order, as a KeyboardInterrupt at the begin of a call would keep it.

    Attributes:
        holder: The thread that runs the loop; None if none does.
        changed: Notified when the turn is given back or an operation ends.
    """

    def __init__(self) -> None:
        self.holder: threading.Thread | None = None
        self.changed = threading.Condition()

    @property
    def mine(self) -> bool:
        """Whether this thread runs the loop."""
        return self.holder is threading.current_thread()

    def take(self, needless: Callable[[], bool] | None = None) -> None:
        """Wait until no other thread runs the loop or reads the joints.

        Args:
            needless: Returns whether the turn is not needed any more.
        """
        me = threading.current_thread()
        with self.changed:
            while self.holder not in {None, me}:
                if needless is not None and needless():
                    return
                self.changed.wait(_POLL)
            self.holder = me
        wake_on_time()

    def notify(self) -> None:
        """Wake the threads that wait for the turn or for the end of an operation."""
        with self.changed:
            self.changed.notify_all()
