"""A new trajectory that takes over from one that runs."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from bioscara.control.joint_trajectory.course import Course
from bioscara.control.joint_trajectory.messages import Point


def completed(
    points: Sequence[Point], missing: Collection[int], running: Course, offset: float
) -> tuple[Point, ...]:
    """Return the points of a partial trajectory, in which other joints go on as they did.

    Where the running trajectory lasts longer, its points follow; the new one's joints wait at
    their end.

    Args:
        points: Of the new trajectory, with some value for the joints that it leaves out.
        missing: Indices of these joints.
        running: The trajectory that runs.
        offset: Time of ``running`` at the new trajectory's time 0 [s].
    """
    if not missing:
        return tuple(points)
    done = [_merged(point, missing, running.sample(point.time + offset).values) for point in points]
    last = points[-1]
    end = Point(last.time, last.positions, (0.0,) * len(last.positions), ())
    for point in running.points:
        time = point.time - offset
        if time > last.time:
            here = running.sample(point.time).values
            done.append(_merged(end._replace(time=time), missing, here))
    return tuple(done)


def _merged(point: Point, missing: Collection[int], other: Sequence[tuple[float, ...]]) -> Point:
    fields = []
    for own, others in zip(
        (point.positions, point.velocities, point.accelerations), other, strict=True
    ):
        fields.append(tuple(others[i] if i in missing else value for i, value in enumerate(own)))
    return Point(point.time, *fields)
