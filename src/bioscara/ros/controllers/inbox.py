"""Messages of a topic that wait for the arm, in a thread of their own."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

PATIENCE = 0.5
"""Time after which a command that has waited is not carried out any more [s]."""


class Inbox:
    """Passes messages on in their order, in a thread of its own; the newest ones replace others.

    The thread that spins gets messages for all subscriptions and must not wait. The owner of the
    arm may be silent, and what was commanded before that must not move the arm after it.

    Args:
        take: Called with each message; must not raise.
        size: Number of messages that wait at most.
        patience: Time after which a message that has waited is dropped [s].
        dropped: Called with the reason then.
        name: Name of the thread.
    """

    def __init__(
        self,
        take: Callable[[Any], object],
        size: int,
        patience: float,
        dropped: Callable[[str], object],
        name: str,
    ) -> None:
        self._take, self._patience, self._dropped = take, patience, dropped
        self._waiting: deque[tuple[float, Any]] = deque(maxlen=size)
        self._come = threading.Condition()
        self._closed = False
        threading.Thread(target=self._run, name=name, daemon=True).start()

    def put(self, message: Any) -> None:
        """Let a message wait."""
        with self._come:
            self._waiting.append((time.monotonic(), message))
            self._come.notify()

    def close(self) -> None:
        """Drop what waits, and end the thread after the present message."""
        with self._come:
            self._closed = True
            self._waiting.clear()
            self._come.notify()

    def _run(self) -> None:
        while True:
            with self._come:
                self._come.wait_for(lambda: self._closed or bool(self._waiting))
                if self._closed:
                    return
                arrived, message = self._waiting.popleft()
            waited = time.monotonic() - arrived
            if waited > self._patience:
                self._dropped(f"a message has waited for {waited:.1f} s and is dropped")
            else:
                self._take(message)
