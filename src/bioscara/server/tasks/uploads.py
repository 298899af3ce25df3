"""Trajectories that come in parts, as one message is too short for them."""

from __future__ import annotations

import threading
from collections import OrderedDict

import numpy as np

from bioscara.api import messages as m
from bioscara.api.values import trajectory_of
from bioscara.errors import InvalidArgumentError
from bioscara.planning import Trajectory

KEPT = 2
"""Number of uploads that are kept."""
POINTS_MAX = 500_000
"""Largest number of points of a trajectory: 80 minutes at 100 Hz."""


class Uploads:
    """The latest uploads, by number. All methods may be called in any thread."""

    def __init__(self) -> None:
        self._parts: OrderedDict[int, list[Trajectory]] = OrderedDict()
        self._last = 0
        self._lock = threading.Lock()

    def add(self, command: m.AddPoints) -> m.PointsAdded:
        """Begin or continue an upload.

        Raises:
            TrajectoryError: The points are no trajectory.
            InvalidArgumentError: There is no such upload, it has other columns, or too many points.
        """
        part = trajectory_of(command.points)
        with self._lock:
            number, parts = command.upload, [part]
            if number:
                parts = [*self._get(number), part]
                _require_same_columns(parts[0], part)
            count = sum(len(each.times) for each in parts)
            if count > POINTS_MAX:
                raise InvalidArgumentError(
                    f"a trajectory has at most {POINTS_MAX} points, and this one {count}; divide it"
                )
            if not number:
                self._last = number = self._last + 1
            self._parts[number] = parts
            while len(self._parts) > KEPT:
                self._parts.popitem(last=False)
            return m.PointsAdded(number, count)

    def completed(self, upload: int, last: m.TrajectoryValue) -> Trajectory:
        """Return the trajectory of an upload and the points after it.

        Args:
            upload: Number of the upload; 0 for none.
            last: The points after it.

        Raises:
            TrajectoryError: The points are no trajectory.
            InvalidArgumentError: There is no such upload, or it has other columns.
        """
        part = trajectory_of(last)
        if not upload:
            return part
        with self._lock:
            parts = [*self._get(upload), part]
        _require_same_columns(parts[0], part)
        velocities = [each.velocities for each in parts if each.velocities is not None]
        accelerations = [each.accelerations for each in parts if each.accelerations is not None]
        return Trajectory(
            part.joint_names,
            np.concatenate([each.times for each in parts]),
            np.concatenate([each.positions for each in parts]),
            np.concatenate(velocities) if velocities else None,
            np.concatenate(accelerations) if accelerations else None,
        )

    def _get(self, number: int) -> list[Trajectory]:
        if number not in self._parts:
            raise InvalidArgumentError(
                f"there is no upload {number}, or it was dropped for newer ones; upload the points "
                "again"
            )
        return self._parts[number]


def _require_same_columns(first: Trajectory, part: Trajectory) -> None:
    """Raise unless a part has the joints and columns of the first one."""
    for what in ("velocities", "accelerations"):
        if (getattr(first, what) is None) != (getattr(part, what) is None):
            raise InvalidArgumentError(f"give {what} in all parts of a trajectory or in none")
    if first.joint_names != part.joint_names:
        raise InvalidArgumentError(
            f"the parts of a trajectory have the joints {', '.join(first.joint_names)} and "
            f"{', '.join(part.joint_names)}; give the same ones in the same order"
        )
