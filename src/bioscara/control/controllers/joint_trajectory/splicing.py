"""A new trajectory that takes over some joints from a running one."""

from __future__ import annotations

from collections.abc import Collection

from bioscara.control.controllers.joint_trajectory.interpolation import CurveState, Interpolator
from bioscara.planning import Sample


class Spliced:
    """A partial trajectory, combined with the running courses of the joints that it leaves out.

    It ends with the last of them; each joint waits at its own end.

    Args:
        course: Of the new trajectory, with some value for the joints that it leaves out.
        missing: Indices of these joints.
        running: The running course.
        offset: Time of ``running`` at the new trajectory's time 0 [s].

    Attributes:
        end: Where the joints are to rest [rad or m].
        duration: Time at which the last of them arrives [s].
        begins: Time from which it is defined [s].
        continuable: Whether a new trajectory may continue from it.
    """

    continuable = True

    def __init__(
        self,
        course: Interpolator,
        missing: Collection[int],
        running: Interpolator | Spliced,
        offset: float,
    ) -> None:
        # A splice of splices refers to the courses themselves, so that no chains grow.
        self._sources = [
            _source(running, joint, offset) if joint in missing else (course, 0.0)
            for joint in range(len(course.end))
        ]
        self._distinct = list(dict.fromkeys([(course, 0.0), *self._sources]))
        self._rows = [(self._distinct.index(each), j) for j, each in enumerate(self._sources)]
        self.begins = course.begins
        self.duration = max(each.duration - ahead for each, ahead in self._distinct)
        self.end = tuple(each.end[joint] for joint, (each, _) in enumerate(self._sources))

    def sample(self, time: float) -> CurveState:
        """Return the state at ``time`` [s since the new trajectory's start], and its point."""
        places = [course.sample(time + offset) for course, offset in self._distinct]
        fields = [
            tuple([places[row].values[field][joint] for row, joint in self._rows])
            for field in range(3)
        ]
        return CurveState(Sample(*fields), places[0].point)

    def source(self, joint: int) -> tuple[Interpolator, float]:
        """Return the course that a joint follows, and the time on it at time 0 [s]."""
        return self._sources[joint]


def _source(
    running: Interpolator | Spliced, joint: int, offset: float
) -> tuple[Interpolator, float]:
    if isinstance(running, Interpolator):
        return running, offset
    course, ahead = running.source(joint)
    return course, ahead + offset
