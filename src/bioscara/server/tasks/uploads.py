"""Trajectories that come in parts, as one message is too short for them."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np

from bioscara.api import messages as m
from bioscara.api.values import trajectory_of
from bioscara.errors import InvalidArgumentError
from bioscara.planning import Trajectory

KEPT = 2
"""Number of uploads that are kept."""

P = TypeVar("P")


class Uploads(Generic[P]):
    """The latest uploads, by number. All methods may be called in any thread.

    Args:
        most: Largest number of points of a trajectory.
        size: Returns the number of points of a part.
        check: Raises unless a part fits the first one of its upload.
    """

    def __init__(
        self, most: int, size: Callable[[P], int], check: Callable[[P, P], None] | None = None
    ) -> None:
        self._most, self._size, self._check = most, size, check
        self._parts: OrderedDict[int, tuple[P, ...]] = OrderedDict()
        self._last = 0
        self._lock = threading.Lock()

    def add(self, upload: int, part: P) -> m.PointsAdded:
        """Begin or continue an upload.

        Args:
            upload: Its number; 0 begins one.
            part: The next points.

        Raises:
            InvalidArgumentError: There is no such upload, the part does not fit the first one, or
                there are too many points.
        """
        with self._lock:
            parts = self._with(upload, part)
            count = sum(map(self._size, parts))
            if count > self._most:
                raise InvalidArgumentError(
                    f"a trajectory has at most {self._most} points, and this one {count}; divide it"
                )
            if not upload:
                self._last = upload = self._last + 1
            self._parts[upload] = parts
            while len(self._parts) > KEPT:
                self._parts.popitem(last=False)
            return m.PointsAdded(upload, count)

    def completed(self, upload: int, last: P) -> tuple[P, ...]:
        """Return the parts of an upload, and the one after them; arguments as :meth:`add`.

        Raises:
            InvalidArgumentError: There is no such upload, or the part does not fit the first one.
        """
        with self._lock:
            return self._with(upload, last)

    def _with(self, upload: int, part: P) -> tuple[P, ...]:
        if not upload:
            return (part,)
        if upload not in self._parts:
            raise InvalidArgumentError(
                f"there is no upload {upload}, or it was dropped for newer ones; upload the points "
                "again"
            )
        parts = self._parts[upload]
        if self._check is not None:
            self._check(parts[0], part)
        return (*parts, part)


class TrajectoryUploads(Uploads[Trajectory]):
    """Uploads of trajectories: 80 minutes at 100 Hz, and no longer."""

    def __init__(self) -> None:
        super().__init__(500_000, lambda part: len(part.times), _require_same_columns)

    def trajectory(self, upload: int, last: m.TrajectoryValue) -> Trajectory:
        """Return the trajectory of an upload and the points after it.

        Args:
            upload: Number of the upload; 0 for none.
            last: The points after it.

        Raises:
            TrajectoryError: The points are no trajectory.
            InvalidArgumentError: As :meth:`completed`.
        """
        parts = self.completed(upload, trajectory_of(last))
        velocities = [each.velocities for each in parts if each.velocities is not None]
        accelerations = [each.accelerations for each in parts if each.accelerations is not None]
        return Trajectory(
            parts[0].joint_names,
            np.concatenate([each.times for each in parts]),
            np.concatenate([each.positions for each in parts]),
            np.concatenate(velocities) if velocities else None,
            np.concatenate(accelerations) if accelerations else None,
        )


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
