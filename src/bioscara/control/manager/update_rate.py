"""When a controller that runs slower than the cycle is due."""

from __future__ import annotations

from bioscara.arguments import whole
from bioscara.errors import ConfigurationError
from bioscara.model.parameters import HIGHEST_RATE, LOWEST_RATE
from bioscara.protocol import SILENCE


def require_rate(rate: int) -> int:
    """Return a rate of cycles [Hz].

    Raises:
        ConfigurationError: It is no whole number, or outside the range of the arm's parameters.
    """
    rate = whole("the rate in Hz", rate, error=ConfigurationError)
    if not LOWEST_RATE <= rate <= HIGHEST_RATE:
        raise ConfigurationError(
            f"rate {rate} Hz is outside {LOWEST_RATE} .. {HIGHEST_RATE} Hz; a joint "
            f"that receives nothing for {1e3 * SILENCE:.0f} ms stops"
        )
    return rate


class Schedule:
    """Measures the time since the last update of one controller.

    The time between updates is the nearest whole number of cycles, at least one.

    Args:
        cycle_rate: Cycles per second [Hz].
        rate: Requested updates per second [Hz]; 0 for every cycle.

    Attributes:
        rate: Resulting updates per second [Hz].

    Raises:
        ConfigurationError: As :func:`require_rate`, or the requested rate is negative.
    """

    __slots__ = ("_elapsed", "_first", "_nominal", "_soonest", "rate")

    def __init__(self, cycle_rate: int, rate: int) -> None:
        cycle_rate = require_rate(cycle_rate)
        if rate < 0:
            raise ConfigurationError(f"update rate {rate} Hz is negative; 0 is every cycle")
        factor = max(round(cycle_rate / rate), 1) if rate else 1
        self.rate = cycle_rate / factor
        self._nominal = 1.0 / self.rate
        # From half a cycle before the due time on, this cycle is nearer to it than the next.
        self._soonest = self._nominal - 0.5 / cycle_rate if factor > 1 else 0.0
        self._elapsed = 0.0
        self._first = True

    def due(self, period: float) -> float:
        """Count a cycle; return the time since the last update [s], or 0 if none is due.

        The first update after activation gets the nominal period. A controller without a rate of
        its own is due in every cycle, however short that is.

        Args:
            period: Time since the last cycle [s].
        """
        if self._first:
            self._first = False
            return self._nominal
        self._elapsed += period
        if self._elapsed < self._soonest:
            return 0.0
        elapsed, self._elapsed = self._elapsed, 0.0
        return elapsed
