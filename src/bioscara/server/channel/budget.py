"""The requests of clients that do not command, limited for the process that moves the arm."""

from __future__ import annotations

import asyncio
from collections import OrderedDict, deque

RATE, BURST = 200.0, 50.0
"""Questions of all these clients in a second [1/s], and at once: each takes some 0.1 ms in the
process of the control loop, 2 % of its time in all."""
COMMANDS = 400.0
"""Commands of all these clients in a second [1/s], such as to take the lease, which wait for none
of the questions."""


class Budget:
    """Gives clients turns, so many in a second, one client after the other.

    Args:
        rate: Turns in a second [1/s].
        burst: Turns at once.
    """

    def __init__(self, rate: float = RATE, burst: float = BURST) -> None:
        self._rate, self._burst = rate, burst
        self._loop = asyncio.get_running_loop()
        self._left, self._time = burst, self._loop.time()
        self._waiting: OrderedDict[str, deque[tuple[float, asyncio.Future[None]]]] = OrderedDict()
        self._timer: asyncio.TimerHandle | None = None

    async def turn(self, client: str, cost: float = 1.0) -> None:
        """Wait for the turn of a client.

        Args:
            client: Its session.
            cost: Turns that it takes.
        """
        granted: asyncio.Future[None] = self._loop.create_future()
        self._waiting.setdefault(client, deque()).append((cost, granted))
        if self._timer is None:
            self._grant()
        await granted

    def _grant(self) -> None:
        self._timer = None
        now = self._loop.time()
        self._left = min(self._left + (now - self._time) * self._rate, self._burst)
        self._time = now
        while self._waiting:
            client, turns = next(iter(self._waiting.items()))
            cost, granted = turns[0]
            if not granted.cancelled():
                if self._left < cost:
                    wait = (cost - self._left) / self._rate
                    self._timer = self._loop.call_later(wait, self._grant)
                    return
                self._left -= cost
                granted.set_result(None)
            turns.popleft()
            self._waiting.move_to_end(client)
            if not turns:
                del self._waiting[client]
