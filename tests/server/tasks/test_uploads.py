"""Trajectories in parts, each a message."""

from __future__ import annotations

import pytest

from bioscara import InvalidArgumentError, TrajectoryError
from bioscara.api import messages as m
from bioscara.api.values import trajectory_of, trajectory_parts, trajectory_value
from bioscara.planning import Trajectory
from bioscara.server.tasks.uploads import TrajectoryUploads, Uploads
from simulated import NAMES


def trajectory(points: int, *, first: int = 0, velocities: bool = True) -> Trajectory:
    times = [0.01 * index for index in range(first, first + points)]
    rows = [[time, 0.1, 0.2, 0.3] for time in times]
    return Trajectory(NAMES, times, rows, [[1.0, 0.0, 0.0, 0.0]] * points if velocities else None)


@pytest.mark.parametrize("velocities", [False, True])
@pytest.mark.parametrize("points", [1, 1000, 1001, 2500])
def test_the_parts_of_a_trajectory_are_the_trajectory(points: int, velocities: bool) -> None:
    whole = trajectory(points, velocities=velocities)
    *parts, last = trajectory_parts(whole)
    kept, number = TrajectoryUploads(), 0
    for each in parts:
        number = kept.add(number, trajectory_of(each)).upload
    assert trajectory_value(kept.trajectory(number, last)) == trajectory_value(whole)
    assert trajectory_value(trajectory_of(last)) == last


def test_a_part_that_does_not_fit_is_refused_and_the_upload_stays() -> None:
    kept = TrajectoryUploads()
    assert kept.add(0, trajectory(10)) == m.PointsAdded(1, 10)
    without = trajectory(10, first=10, velocities=False)
    with pytest.raises(InvalidArgumentError, match="give velocities in all parts"):
        kept.add(1, without)
    with pytest.raises(InvalidArgumentError, match="give velocities in all parts"):
        kept.trajectory(1, trajectory_value(without))
    with pytest.raises(InvalidArgumentError, match="have the joints j1, j2, j3, j4 and j1"):
        kept.add(1, Trajectory(("j1",), (1.0,), ((0.0,),), ((0.0,),)))
    assert kept.add(1, trajectory(10, first=10)) == m.PointsAdded(1, 20)
    with pytest.raises(TrajectoryError):
        kept.trajectory(1, trajectory_value(trajectory(1, first=5)))
    last = trajectory_value(trajectory(1, first=20))
    assert kept.trajectory(1, last).duration == pytest.approx(0.2)


def test_uploads_are_bounded() -> None:
    kept = Uploads[str](30, len)
    for number in range(1, 5):
        assert kept.add(0, "ab").upload == number
    for lost in (-1, 1, 2, 5):
        with pytest.raises(InvalidArgumentError, match=f"there is no upload {lost}"):
            kept.add(lost, "ab")
    kept.add(4, 28 * "a")
    with pytest.raises(InvalidArgumentError, match="at most 30 points, and this one 31"):
        kept.add(4, "a")
