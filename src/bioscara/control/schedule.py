"""When a controller that runs slower than the cycle is due."""

from __future__ import annotations

from bioscara.errors import ConfigurationError


class Schedule:
    """Counts cycles for one controller.

    A rate that does not divide that of the cycle becomes the nearest one that does; a higher one
    becomes that of the cycle.

    Args:
        cycle_rate: Cycles per second [Hz].
        rate: Updates per second that were asked for [Hz]; 0 for every cycle.

    Attributes:
        rate: Updates per second that come of it [Hz].

    Raises:
        ConfigurationError: A rate is not above zero.
    """

    def __init__(self, cycle_rate: int, rate: int) -> None:
        if cycle_rate <= 0 or rate < 0:
            raise ConfigurationError(f"rates {cycle_rate} and {rate} Hz must be above zero")
        self._factor = max(round(cycle_rate / rate), 1) if rate else 1
        self.rate = cycle_rate / self._factor
        self._nominal = 1.0 / self.rate
        self._count = self._factor
        self._elapsed = 0.0
        self._first = True

    def due(self, period: float) -> float:
        """Count a cycle; return the time since the last update [s], or 0 if none is due.

        The first update after activation is told the nominal period.

        Args:
            period: Time since the last cycle [s].
        """
        self._count += 1
        self._elapsed += period
        if self._count < self._factor:
            return 0.0
        elapsed = self._nominal if self._first else self._elapsed
        self._count, self._elapsed, self._first = 0, 0.0, False
        return elapsed
