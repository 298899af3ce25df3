"""Limits of how often something may happen."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable


class RateLimit:
    """A token bucket: so much at once, and so much per second from then on.

    Args:
        burst: How much may happen at once.
        per_second: How much may happen in a second [1/s].
        clock: Returns the time [s].
    """

    def __init__(
        self, burst: float, per_second: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._burst, self._rate, self._clock = burst, per_second, clock
        self._left, self._time = burst, clock()

    def take(self, cost: float = 1.0) -> bool:
        """Return whether it may happen now, and count it if so."""
        now = self._clock()
        self._left = min(self._left + (now - self._time) * self._rate, self._burst)
        self._time = now
        if self._left < cost:
            return False
        self._left -= cost
        return True


class RateLimits:
    """A rate limit for each of the latest clients.

    Args:
        burst: How much each may do at once.
        per_second: How much each may do in a second [1/s].
        most: Number of clients that are remembered.
        clock: Returns the time [s].
    """

    def __init__(
        self,
        burst: float,
        per_second: float,
        most: int = 4096,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._burst, self._rate, self._most, self._clock = burst, per_second, most, clock
        self._limits: OrderedDict[str, RateLimit] = OrderedDict()

    def take(self, client: str, cost: float = 1.0) -> bool:
        """Return whether a client may go on, and count it if so."""
        limit = self._limits.get(client)
        if limit is None:
            limit = self._limits[client] = RateLimit(self._burst, self._rate, self._clock)
        self._limits.move_to_end(client)
        while len(self._limits) > self._most:
            self._limits.popitem(last=False)
        return limit.take(cost)
