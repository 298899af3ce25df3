"""Times of ROS, and those of the arm's clock."""

from __future__ import annotations

from collections.abc import Callable


class ArmTime:
    """Converts times, by the latest sample.

    Args:
        simulated: Returns the time of ROS [s] where ``use_sim_time`` is set, else None.
    """

    def __init__(self, simulated: Callable[[], float | None]) -> None:
        self._simulated = simulated
        self._offset = 0.0

    def update(self, time: float, wall: float) -> None:
        """Take the times of a sample.

        Args:
            time: Begin of its cycle [s, arm's clock].
            wall: The same time, in seconds since 1970.
        """
        simulated = self._simulated()
        self._offset = (wall if simulated is None else simulated) - time

    def arms(self, time: float) -> float:
        """Return a time of ROS on the arm's clock [s]."""
        return time - self._offset

    def ros(self, time: float) -> float:
        """Return a time of the arm's clock in ROS [s]."""
        return time + self._offset
