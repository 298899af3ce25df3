"""Trajectories in parts, each a message."""

from __future__ import annotations

import pytest

from bioscara import InvalidArgumentError, TrajectoryError
from bioscara.api import messages as m
from bioscara.api.values import trajectory_of, trajectory_parts, trajectory_value
from bioscara.planning import Trajectory
from bioscara.server.tasks import uploads
from bioscara.server.tasks.uploads import Uploads
from simulated import NAMES


def trajectory(points: int, *, first: int = 0, velocities: bool = True) -> Trajectory:
    times = [0.01 * index for index in range(first, first + points)]
    rows = [[time, 0.1, 0.2, 0.3] for time in times]
    return Trajectory(NAMES, times, rows, [[1.0, 0.0, 0.0, 0.0]] * points if velocities else None)


def part(points: int, *, upload: int = 0, first: int = 0, velocities: bool = True) -> m.AddPoints:
    value = trajectory_value(trajectory(points, first=first, velocities=velocities))
    return m.AddPoints(points=value, upload=upload)


@pytest.mark.parametrize("velocities", [False, True])
@pytest.mark.parametrize("points", [1, 1000, 1001, 2500])
def test_the_parts_of_a_trajectory_are_the_trajectory(points: int, velocities: bool) -> None:
    whole = trajectory(points, velocities=velocities)
    *parts, last = trajectory_parts(whole)
    kept, number = Uploads(), 0
    for each in parts:
        number = kept.add(m.AddPoints(points=each, upload=number)).upload
    assert trajectory_value(kept.completed(number, last)) == trajectory_value(whole)
    assert trajectory_value(trajectory_of(last)) == last


def test_a_part_that_does_not_fit_is_refused_and_the_upload_stays() -> None:
    kept = Uploads()
    begun = kept.add(part(10))
    assert begun == m.PointsAdded(1, 10)
    with pytest.raises(InvalidArgumentError, match="give velocities in all parts"):
        kept.add(part(10, upload=1, first=10, velocities=False))
    with pytest.raises(InvalidArgumentError, match="give velocities in all parts"):
        kept.completed(1, part(1, first=10, velocities=False).points)
    other = m.TrajectoryValue(("j1",), (1.0,), ((0.0,),), ((0.0,),))
    with pytest.raises(InvalidArgumentError, match="have the joints j1, j2, j3, j4 and j1"):
        kept.add(m.AddPoints(points=other, upload=1))
    assert kept.add(part(10, upload=1, first=10)) == m.PointsAdded(1, 20)
    with pytest.raises(TrajectoryError):
        kept.completed(1, part(1, first=5).points)
    assert kept.completed(1, part(1, first=20).points).duration == pytest.approx(0.2)


def test_uploads_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    kept = Uploads()
    for number in range(1, 5):
        assert kept.add(part(2)).upload == number
    for lost in (-1, 1, 2, 5):
        with pytest.raises(InvalidArgumentError, match=f"there is no upload {lost}"):
            kept.add(part(2, upload=lost, first=2))
    monkeypatch.setattr(uploads, "POINTS_MAX", 30)
    kept.add(part(28, upload=4, first=2))
    with pytest.raises(InvalidArgumentError, match="at most 30 points, and this one 31"):
        kept.add(part(1, upload=4, first=30))
