"""A motion of the arm as a table over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bioscara.errors import TrajectoryError
from bioscara.planning import Trajectory
from bioscara.planning.arrays import Array

_PERIOD, _ROWS_MAX = 0.01, 20_000
"""Time between two samples of a trajectory [s], and their largest number."""


@dataclass(frozen=True, slots=True, eq=False)
class PlayedMotion:
    """A motion of j1 to j4; between two rows the joints move at constant speed.

    Attributes:
        title: What it is, in words.
        times: Times of the rows, not decreasing [s], shape (n,), n at least 1.
        positions: Positions of the joints [rad, m, rad, rad], shape (n, 4).
        phases: The part of the motion that each row belongs to; empty strings if it has no parts.
        notes: Sentences on the motion for the user.
    """

    title: str
    times: Array
    positions: Array
    phases: Sequence[str]
    notes: tuple[str, ...] = ()

    @classmethod
    def of_trajectory(
        cls,
        title: str,
        trajectory: Trajectory,
        names: Sequence[str],
        elsewhere: Sequence[float],
        notes: tuple[str, ...] = (),
    ) -> PlayedMotion:
        """Sample a trajectory.

        Args:
            title: What it is, in words.
            trajectory: For some or all of the joints.
            names: Names of j1 to j4.
            elsewhere: Positions of the joints that it does not name [rad, m, rad, rad].
            notes: Sentences on it for the user.

        Raises:
            TrajectoryError: It names a joint that the arm does not have.
        """
        for name in trajectory.joint_names:
            if name not in names:
                raise TrajectoryError(
                    f"{name} is not a joint of the arm; it has {', '.join(names)}"
                )
        count = min(int(trajectory.duration / _PERIOD) + 2, _ROWS_MAX)
        times = np.linspace(0.0, trajectory.duration, count)
        positions = np.tile(np.asarray(elsewhere, dtype=np.float64), (count, 1))
        columns = [names.index(name) for name in trajectory.joint_names]
        positions[:, columns] = trajectory.sample_many(times)[0]
        return cls(title, times, positions, ("",) * count, notes)

    @property
    def start(self) -> float:
        """Time of the first row [s]."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """Time of the last row [s]."""
        return float(self.times[-1])

    def at(self, time: float) -> tuple[float, ...]:
        """Return the positions at ``time`` [s]; before the start and after the end it rests."""
        return tuple(float(np.interp(time, self.times, column)) for column in self.positions.T)

    def phase(self, time: float) -> str:
        """Return the part of the motion at ``time`` [s]."""
        row = int(np.searchsorted(self.times, time, side="right")) - 1
        return self.phases[max(row, 0)]
