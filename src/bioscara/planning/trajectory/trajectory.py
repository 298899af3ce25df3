"""The trajectory type: points in joint space, and the curve between them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bioscara.arguments import array, items, number, shown
from bioscara.errors import TrajectoryError
from bioscara.extras import pip_install, require
from bioscara.notebook import table
from bioscara.planning.arrays import Array
from bioscara.planning.trajectory.polynomials import (
    Sample,
    cubic,
    evaluate,
    evaluate_many,
    line,
    quintic,
)

if TYPE_CHECKING:
    import pandas

STEP_MIN = 1e-6
"""Shortest time between two points [s]; the curve's coefficients divide by its fifth power."""


class Trajectory:
    """A timed motion of some joints; immutable.

    Between two points the curve is a quintic polynomial where both velocities and accelerations
    are given, a cubic where only velocities are, and a straight line otherwise: the interpolation
    of ros2_control's joint trajectory controller. Before the first point it rests at the first
    point, after the last point at the last one.

    Args:
        joint_names: The joints.
        times: Time of each point [s], shape (n,), not negative and strictly increasing.
        positions: [rad or m], shape (n, joints).
        velocities: [rad/s or m/s], shape (n, joints), or None.
        accelerations: [rad/s^2 or m/s^2], shape (n, joints), or None; needs velocities.
        cubics: The cubics between points with velocities, if known from a planner: factors of
            the time squared and cubed, shape (n - 1, joints, 2). The points determine the same
            cubics except for rounding: over 10 us, the acceleration to 1e-5 rad/s^2.

    Attributes:
        joint_names: The joints.
        times: As given, read-only.
        positions: As given, read-only.
        velocities: As given, read-only, or None.
        accelerations: As given, read-only, or None.

    Raises:
        TrajectoryError: A size does not fit, a value is not finite, or times do not increase.
    """

    def __init__(
        self,
        joint_names: Sequence[str],
        times: npt.ArrayLike,
        positions: npt.ArrayLike,
        velocities: npt.ArrayLike | None = None,
        accelerations: npt.ArrayLike | None = None,
        *,
        cubics: npt.ArrayLike | None = None,
    ) -> None:
        self.joint_names = items("the joint names", joint_names, error=TrajectoryError)
        _check_names(self.joint_names)
        self.times = _frozen("times", times)
        count = self.times.shape[0] if self.times.ndim == 1 else 0
        if count == 0:
            raise TrajectoryError("a trajectory needs at least one point; this one has none")
        shape = (count, len(self.joint_names))
        self.positions = self._column("position", positions, shape)
        self.velocities = (
            None if velocities is None else self._column("velocity", velocities, shape)
        )
        if accelerations is not None and velocities is None:
            raise TrajectoryError("accelerations are given without velocities; give both or none")
        self.accelerations = (
            None if accelerations is None else self._column("acceleration", accelerations, shape)
        )
        _check_times(self.times, STEP_MIN if cubics is None else 0.0)
        with np.errstate(all="ignore"):
            self._coefficients = self._segments(cubics)
        if not np.isfinite(self._coefficients).all():
            raise TrajectoryError("the values are too large for a curve between the points")
        self._coefficients.setflags(write=False)
        self._starts: list[float] = self.times.tolist()

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in vars(self).items() if key != "_starts"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
        self._starts = self.times.tolist()

    def __repr__(self) -> str:
        return (
            f"<Trajectory {', '.join(self.joint_names)}: {len(self._starts)} points, "
            f"{self.duration:g} s>"
        )

    def _repr_html_(self) -> str:
        ends = self.positions[[0, -1]].T.tolist()
        rows = [
            (name, f"{start:z.4f}", f"{end:z.4f}")
            for name, (start, end) in zip(self.joint_names, ends, strict=True)
        ]
        what = f"{len(self._starts)} points, {self.duration:.3f} s"
        return table(rows, (what, "start [rad or m]", "end [rad or m]"))

    def columns(self) -> dict[str, Array]:
        """Return the points as columns, named as in a CSV file: ``time``, ``j1_position``, ..."""
        columns = {"time": self.times}
        for what, values in (
            ("position", self.positions),
            ("velocity", self.velocities),
            ("acceleration", self.accelerations),
        ):
            if values is not None:
                named = zip(self.joint_names, values.T, strict=True)
                columns |= {f"{name}_{what}": column for name, column in named}
        return columns

    def to_pandas(self) -> pandas.DataFrame:
        """Return a frame with one row per point and the columns of a CSV file of trajectories.

        Raises:
            NotSupportedError: pandas is not installed.
        """
        require("pandas", "to_pandas()", pip_install("pandas"))
        import pandas  # noqa: PLC0415  takes a second, and is optional

        return pandas.DataFrame(self.columns())

    @property
    def duration(self) -> float:
        """Time of the last point [s]."""
        return self._starts[-1]

    @property
    def coefficients(self) -> Array:
        """Polynomials, shape (n - 1, joints, 6): powers of the time since the segment's start.

        Read-only.
        """
        return self._coefficients

    def completed(self, joint_names: Sequence[str], elsewhere: Sequence[float]) -> Trajectory:
        """Return this motion as one of all joints, of which the others hold.

        Args:
            joint_names: All joints, in the order of the result; those of this trajectory among
                them.
            elsewhere: For each the position at which it holds if it is another [rad or m].
        """
        if self.joint_names == tuple(joint_names):
            return self
        columns = [joint_names.index(name) for name in self.joint_names]

        def wide(values: Array | None) -> Array | None:
            if values is None:
                return None
            made = np.zeros((len(values), len(joint_names), *values.shape[2:]))
            made[:, columns] = values
            return made

        positions = np.tile(np.asarray(elsewhere, dtype=np.float64), (len(self._starts), 1))
        positions[:, columns] = self.positions
        # A planner may have known the cubics better than the points determine them.
        known = self.velocities is not None and self.accelerations is None
        return Trajectory(
            joint_names,
            self.times,
            positions,
            wide(self.velocities),
            wide(self.accelerations),
            cubics=wide(self._coefficients[..., 2:4]) if known else None,
        )

    def sample(self, time: float) -> Sample:
        """Return the state at ``time`` [s].

        Raises:
            TrajectoryError: The time is not a number.
        """
        starts, time = self._starts, number("time", time, infinite=True, error=TrajectoryError)
        if not starts[0] <= time < starts[-1]:
            row = self.positions[0 if time < starts[0] else -1].tolist()
            rest = (0.0,) * len(row)
            return Sample(tuple(row), rest, rest)
        index = bisect_right(starts, time) - 1
        return evaluate(self._coefficients[index].tolist(), time - starts[index])

    def sample_many(self, times: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """Return positions, velocities and accelerations at ``times`` [s], each (m, joints).

        Raises:
            TrajectoryError: A time is not a number.
        """
        at = array("times", times, error=TrajectoryError)
        if np.isnan(at).any():
            raise TrajectoryError("a trajectory has no state at time nan; give seconds")
        positions = np.empty((*at.shape, len(self.joint_names)))
        velocities, accelerations = np.zeros_like(positions), np.zeros_like(positions)
        before, after = at < self.times[0], at >= self.times[-1]
        positions[before], positions[after] = self.positions[0], self.positions[-1]
        inside = ~(before | after)
        if inside.any():
            index = np.searchsorted(self.times, at[inside], side="right") - 1
            positions[inside], velocities[inside], accelerations[inside] = evaluate_many(
                self._coefficients[index], at[inside] - self.times[index]
            )
        return positions, velocities, accelerations

    def _column(self, what: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> Array:
        column = _frozen(what, values)
        if column.shape != shape:
            raise TrajectoryError(
                f"{what}: shape {column.shape} does not fit {shape[0]} points of {shape[1]} joints"
            )
        if not np.isfinite(column).all():
            point, joint = (int(index) for index in np.argwhere(~np.isfinite(column))[0][:2])
            raise TrajectoryError(
                f"point {point}: {what} of {self.joint_names[joint]} is {_first_odd(column)}; "
                f"every value must be a finite number"
            )
        return column

    def _segments(self, cubics: npt.ArrayLike | None) -> Array:
        count, joints = self.positions.shape
        c = np.zeros((count - 1, joints, 6))
        if count == 1:
            return c
        p0, p1, t = self.positions[:-1], self.positions[1:], np.diff(self.times)[:, None]
        if self.velocities is None:
            columns = line(p0, p1, t)
        else:
            v0, v1 = self.velocities[:-1], self.velocities[1:]
            if cubics is not None:
                known = self._column("cubics", cubics, (count - 1, joints, 2))
                columns = p0, v0, known[..., 0], known[..., 1]
            elif self.accelerations is None:
                columns = cubic(p0, p1, v0, v1, t)
            else:
                a0, a1 = self.accelerations[:-1], self.accelerations[1:]
                columns = quintic(p0, p1, v0, v1, a0, a1, t)
        for power, column in enumerate(columns):
            c[..., power] = column
        return c


def _frozen(what: str, values: npt.ArrayLike) -> Array:
    column = array(what, values, error=TrajectoryError)
    column.setflags(write=False)
    return column


def _first_odd(column: Array) -> float:
    return float(column[~np.isfinite(column)][0])


def _check_names(names: tuple[str, ...]) -> None:
    if not names:
        raise TrajectoryError("a trajectory needs at least one joint; this one names none")
    for name in names:
        if not isinstance(name, str):
            raise TrajectoryError(f"joint name {shown(name)} is not a text")
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise TrajectoryError(f"joint named twice: {', '.join(twice)}")


def _check_times(times: Array, least: float) -> None:
    if not np.isfinite(times).all():
        raise TrajectoryError(f"point {int(np.argmin(np.isfinite(times)))}: time is not finite")
    if times[0] < 0.0:
        raise TrajectoryError(f"point 0: time {times[0]:g} s is negative")
    steps = np.diff(times)
    near = (steps > 0.0) & (steps < least)
    if near.any():
        point = int(np.argmax(near)) + 1
        raise TrajectoryError(
            f"point {point}: comes {steps[point - 1]:g} s after the one before; points are at "
            f"least {least:g} s apart"
        )
    if (steps <= 0.0).any():
        point = int(np.argmax(steps <= 0.0)) + 1
        raise TrajectoryError(
            f"point {point}: time {times[point]:g} s does not come after {times[point - 1]:g} s; "
            f"times must increase strictly"
        )
