"""Time parameterisation of a tool path: as fast as the limits of joints and tool allow.

The path is sampled on a grid; the phase plane gives the largest speed at each of its points. From
the second pass on, the grid is uniform in time, hence fine wherever the arm must be slow: at both
ends and near stretched positions. Pieces on which the curve between the points exceeds a limit or
leaves the path are subdivided. The remaining excess, a few parts in ten thousand, is removed by
stretching the whole trajectory in time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Joints, Scara, batch
from bioscara.kinematics.elementary import sin_cos
from bioscara.planning.arrays import Array, Index
from bioscara.planning.limits import FULL, JointLimits, ToolLimits, check_share
from bioscara.planning.paths.inverse_kinematics import along
from bioscara.planning.paths.segments import Path
from bioscara.planning.topp.constraints import (
    GridSamples,
    acceleration_limits,
    sample_grid,
    speed_limits,
)
from bioscara.planning.topp.diagnostics import (
    SLOWEST,
    check_places,
    check_speeds,
    check_start,
    check_turns,
)
from bioscara.planning.topp.phase_plane import Rows, fastest
from bioscara.planning.topp.singular_ends import RegularPart, regular_part, with_ends
from bioscara.planning.trajectory.retiming import stretched
from bioscara.planning.trajectory.trajectory import Trajectory

_PIECES = 80
"""Pieces of the first grid."""
_PIECES_BETWEEN = 8
"""Pieces of the first grid between two breaks, so that no blend is missed."""
_STEP, _FEWEST, _MOST = 10e-3, 60, 4000
"""Time between two points [s], and least and greatest number of pieces before the refinement."""
_EXCESS, _FINEST, _REFINEMENTS, _PARTS = 1e-3, 1e-4, 6, 8
"""Share by which a piece may exceed a limit before it is cut, the shortest duration of a piece that
is cut [s], the most refinements, and the most parts of a piece in each."""
_ABRUPT = 2.0
"""Factor in time from which a single abrupt point would slow down the whole motion too much."""
_DEVIATION = 3e-7
"""Deviation of the curve from the path between two points above which its piece is cut [rad or m];
a few tenths of a micrometre at the tool."""
_REVERSAL, _BEFORE, _AFTER = 0.9, 0.1, 0.4
"""Share of the highest speed near the reversal of a joint, and how long before and after it [s]."""
_APART = 1e-5
"""Breaks less than this apart [s] become one point of the grid."""
_TOOL_SAMPLES = (0.25, 0.5, 0.75)
"""Samples of the tool between two points, in shares of the time."""
_BETWEEN = 1e-5
"""Share by which the tool may exceed a limit between two samples."""


def parameterise(
    kinematics: Scara,
    path: Path,
    start: Joints,
    limits: Sequence[JointLimits],
    tool: ToolLimits | None = None,
    *,
    velocity_scaling: float | Sequence[float] = 1.0,
    window: float = 0.0,
) -> Trajectory:
    """Return the fastest motion of the tool along a path, from rest to rest.

    With a window, its speed along the path is the average of the fastest motion's over that time,
    so accelerations do not jump. The motion takes that much longer, and a little more if the speed
    has to change along the path.

    Args:
        kinematics: The arm.
        path: Of the tool.
        start: Joints at the path's beginning [rad, m, rad, rad]; the elbow stays on their side.
        limits: Of the joints, j1 to j4.
        tool: Limits of the tool; those of :class:`ToolLimits` unless given.
        velocity_scaling: Share of the speed to use, 0.001 to 1: the same motion takes the inverse
            of it as long. One share, or one for each segment of the path between its breaks.
        window: Window over which speeds along the path are averaged [s]; 0 for no averaging.

    Returns:
        A trajectory of cubics on which no limit of a joint or the tool is exceeded by more than
        1e-6 of it.

    Raises:
        InvalidArgumentError: The share is outside its range, or a value is not finite.
        UnreachableError: The start is outside limits.
        PathError: The arm cannot reach or pass a point on the path.
        TrajectoryError: The path does not begin at the start.
    """
    tool = ToolLimits() if tool is None else tool
    shares = _shares(path, velocity_scaling)
    highest, shares = float(shares.max()), shares / shares.max()
    check_start(kinematics, path, start)
    part = regular_part(kinematics, path, start)
    side = part.side
    grid = _first_grid(path, part)
    _, squares = _solve_on_grid(kinematics, path, side, limits, tool, grid, shares)
    grid = _even_in_time(grid, squares, path.breaks, shares)
    names = [limit.name for limit in limits]
    if window:
        over = window * highest
        samples, squares = _solve_on_grid(kinematics, path, side, limits, tool, grid, shares, over)
        points = _averaged(kinematics, path, side, limits, (grid, squares), over)
        trajectory = Trajectory(names, *points)
        check_turns(kinematics, path, side, samples, trajectory)
    for _ in range(0 if window else _REFINEMENTS + 1):
        samples, squares = _solve_on_grid(kinematics, path, side, limits, tool, grid, shares)
        velocities = samples.joints.first * np.sqrt(squares)[:, None]
        points = _times(grid, squares), samples.joints.joints, velocities
        trajectory = Trajectory(names, *points)
        factors = _factors_of_pieces(trajectory, kinematics, limits, tool)
        deviations = _deviations(kinematics, path, side, grid, squares, trajectory)
        parts = _parts(factors, deviations, np.diff(trajectory.times))
        if parts.max() < 2:
            break
        grid = _cut(grid, parts)
    if not window:
        check_turns(kinematics, path, side, samples, trajectory)
        left = np.diff(samples.grid) / np.diff(trajectory.times) / factors
        check_speeds(kinematics, path, side, samples, np.where(factors > _ABRUPT, left**2, np.inf))
    if (part.begin, part.end) != (0.0, path.length):
        points = with_ends(kinematics, path, part, start, points, limits, tool)
        trajectory = Trajectory(names, *points)
        factors = _factors_of_pieces(trajectory, kinematics, limits, tool)
    if window:
        factors = _factors_of_pieces(trajectory, kinematics, limits, tool)
    factor = max(1.0, (1.0 + _BETWEEN) * float(factors.max()))
    return stretched(trajectory, factor / highest)


def _parts(factors: Array, deviations: Array, durations: Array) -> Index:
    """Return the number of parts to cut each piece into, 1 if it may stay as it is.

    The excess of a piece falls with the square of its length, its deviation from the path with the
    fourth power.
    """
    wanted = np.maximum(
        np.sqrt((factors - 1.0).clip(0.0) / _EXCESS), np.sqrt(np.sqrt(deviations / _DEVIATION))
    )
    divisible = durations > _FINEST
    coarse = (wanted > 1.0) & divisible
    # A limit that binds on a coarse piece may soon bind on its neighbours.
    wide = coarse.copy()
    wide[:-1] |= coarse[1:]
    wide[1:] |= coarse[:-1]
    parts = np.ceil(np.clip(wanted, 2.0, _PARTS)).astype(np.intp)
    return np.where(wide & divisible, parts, 1)


def _cut(grid: Array, parts: Index) -> Array:
    """Return the grid with each piece cut into equal parts."""
    piece = np.repeat(np.arange(len(parts)), parts)
    part = np.arange(len(piece)) - (np.cumsum(parts) - parts)[piece]
    return np.append(grid[piece] + np.diff(grid)[piece] * (part / parts[piece]), grid[-1])


def _shares(path: Path, scaling: float | Sequence[float]) -> Array:
    """Return the share of the speed on each segment between the breaks of a path."""
    segments = len(path.breaks) + 1
    shares = np.full(segments, scaling) if np.ndim(scaling) == 0 else np.array(scaling)
    if shares.shape != (segments,):
        raise InvalidArgumentError(
            f"{len(shares)} shares of the speed do not fit the {segments} segments of the path"
        )
    for share in shares.tolist():
        check_share(share)
    return shares


def _solve_on_grid(
    kinematics: Scara,
    path: Path,
    start: Joints,
    limits: Sequence[JointLimits],
    tool: ToolLimits,
    grid: Array,
    shares: Array,
    window: float = 0.0,
) -> tuple[GridSamples, Array]:
    """Evaluate the path on the grid; return it and the squares of the largest speeds there.

    With a window, these are speeds whose average over it keeps the speed limits.
    """
    samples = sample_grid(kinematics, path, start, grid)
    check_places(kinematics, path, start, samples)
    share = shares[np.searchsorted(path.breaks, grid[:-1], side="right")] ** 2
    along, across = acceleration_limits(samples, limits, tool)
    slowed = Rows(along / share[:, None], across / share[:, None])
    lower = np.minimum(np.append(share, 1.0), np.append(1.0, share))
    highest = lower * speed_limits(samples, limits, tool)
    squares, bound = fastest(np.diff(grid), slowed, highest)
    if (bound < share * SLOWEST**2).any():
        # The tool's limits may be that low on purpose: only the joints are checked.
        alone = acceleration_limits(samples, limits, FULL), speed_limits(samples, limits, FULL)
        check_speeds(kinematics, path, start, samples, fastest(np.diff(grid), *alone)[1])
    if window:
        low = _lowered(grid, _slowed_at_reversals(grid, samples, squares, highest), window)
        if (low < squares).any():
            squares, _ = fastest(np.diff(grid), slowed, np.minimum(highest, low))
    return samples, squares


def _first_grid(path: Path, part: RegularPart) -> Array:
    """Return a grid that is finer towards both ends, and fine in each piece between breaks."""
    begin, end, _ = part
    _, ends = sin_cos(np.linspace(0.0, math.pi, _PIECES + 1))
    edges = np.array((begin, *path.breaks, end))
    pieces = np.linspace(edges[:-1], edges[1:], _PIECES_BETWEEN + 1).ravel()
    return np.union1d(begin + 0.5 * (end - begin) * (1.0 - ends), pieces)


def _times(grid: Array, squares: Array) -> Array:
    rates = np.sqrt(squares)
    return np.concatenate(([0.0], np.cumsum(2.0 * np.diff(grid) / (rates[:-1] + rates[1:]))))


def _slowed_at_reversals(
    grid: Array, samples: GridSamples, squares: Array, highest: Array
) -> Array:
    """Return squares of speed that are lower near reversals of a joint along the path.

    There the load sticks for a moment, breaks away and swings, even in a smooth motion.
    """
    times, lower = _times(grid, squares), squares.copy()
    signs = np.sign(samples.joints.first)
    for index in np.flatnonzero((signs[:-1] * signs[1:] < 0.0).any(axis=1)):
        since = times - times[index]
        near = (since > -_BEFORE) & (since < _AFTER)
        lower[near] = np.minimum(lower[near], _REVERSAL**2 * highest[near])
    return lower


def _lowered(grid: Array, squares: Array, window: float) -> Array:
    """Return squares of speed whose average over a window is nowhere above those given.

    Before the first maximum and after the last one the motion starts from rest or ends at rest.
    There no speed is lowered: the average only has later and rounded ramps.
    """
    times, squares = _times(grid, squares), squares.copy()
    tops = np.flatnonzero((squares[1:-1] >= squares[:-2]) & (squares[1:-1] >= squares[2:])) + 1
    if not len(tops):
        return np.full(len(grid), np.inf)
    squares[: tops[0]], squares[tops[-1] + 1 :] = squares[tops[0]], squares[tops[-1]]
    begins = np.searchsorted(times, times - window / 2.0)
    ends = np.searchsorted(times, times + window / 2.0, side="right")
    # The minimum between two points, from the minima of runs whose lengths are powers of two.
    runs = [squares]
    while 2 ** len(runs) <= len(squares):
        half = 2 ** (len(runs) - 1)
        runs.append(np.minimum(runs[-1][:-half], runs[-1][half:]))
    rank = np.frexp(ends - begins)[1] - 1  # of the power of two
    return np.array(
        [min(runs[r][b], runs[r][e - 2**r]) for r, b, e in zip(rank, begins, ends, strict=True)]
    )


class _AveragedTiming:
    """Path parameter as a function of time: the average of a motion over a window.

    Args:
        grid: Path parameters [m].
        squares: Squares of the speed there.
        window: Window over which the motion is averaged [s].
    """

    def __init__(self, grid: Array, squares: Array, window: float) -> None:
        self._grid, self._rates = grid, np.sqrt(squares)
        self._times, self.window = _times(grid, squares), window
        steps = np.diff(self._times)
        self._rises = np.diff(self._rates) / steps
        areas = steps * (grid[:-1] + steps * (self._rates[:-1] / 2.0 + steps * self._rises / 6.0))
        self._areas = np.concatenate(([0.0], np.cumsum(areas)))
        self.duration = float(self._times[-1]) + window

    def at(self, times: Array) -> tuple[Array, Array]:
        """Return path parameters and speeds at some times."""
        (here, area), (before, less) = self._sums(times), self._sums(times - self.window)
        return (area - less) / self.window, (here - before) / self.window

    def _sums(self, times: Array) -> tuple[Array, Array]:
        """Return the path parameter of the motion before averaging, and its integral."""
        end = self._times[-1]
        inside = np.clip(times, 0.0, end)
        piece = np.clip(
            np.searchsorted(self._times, inside, side="right") - 1, 0, len(self._rises) - 1
        )
        t, at, rate, rise = (
            inside - self._times[piece],
            self._grid[piece],
            self._rates[piece],
            self._rises[piece],
        )
        here = at + t * (rate + t * rise / 2.0)
        area = self._areas[piece] + t * (at + t * (rate / 2.0 + t * rise / 6.0))
        outside = times - inside
        return here, area + outside * np.where(outside < 0.0, self._grid[0], self._grid[-1])


def _averaged(
    kinematics: Scara,
    path: Path,
    side: Joints,
    limits: Sequence[JointLimits],
    motion: tuple[Array, Array],
    window: float,
) -> tuple[Array, Array, Array]:
    """Return times, positions and velocities of the average of a motion over a window."""
    timing = _AveragedTiming(*motion, window)
    count = max(math.ceil(timing.duration / _STEP), _FEWEST)
    times = np.linspace(0.0, timing.duration, count + 1)
    for _ in range(_REFINEMENTS + 1):
        places, rates = timing.at(times)
        places[0], places[-1] = motion[0][0], motion[0][-1]
        samples = along(kinematics, path.sample(places), side)
        positions, velocities = samples.joints, samples.first * rates[:, None]
        velocities[[0, -1]] = 0.0
        curve = Trajectory([limit.name for limit in limits], times, positions, velocities)
        t = np.diff(times)
        halves, _ = timing.at(times[:-1] + 0.5 * t)
        there, c = along(kinematics, path.sample(halves), side).joints, curve.coefficients
        half = 0.5 * t[:, None]
        here = c[..., 0] + half * (c[..., 1] + half * (c[..., 2] + half * c[..., 3]))
        off = np.abs(here - there).max(axis=1)
        parts = _parts(np.ones(len(t)), np.where(np.isnan(off), math.inf, off), t)
        if parts.max() < 2:
            break
        times = _cut(times, parts)
    return times, positions, velocities


def _even_in_time(grid: Array, squares: Array, breaks: tuple[float, ...], shares: Array) -> Array:
    """Return a grid whose pieces all take about the same time, with the path's breaks.

    A slow piece of the path has its points further apart, by the root of its speed share, so that
    enough remain for all others. Of breaks that almost coincide the grid contains the last: points
    of a trajectory need a minimum distance in time.
    """
    rates, times = np.sqrt(squares), _times(grid, squares)
    effort = np.diff(times) * np.sqrt(shares[np.searchsorted(breaks, grid[:-1], side="right")])
    efforts = np.concatenate(([0.0], np.cumsum(effort)))
    count = min(max(math.ceil(efforts[-1] / _STEP), _FEWEST), _MOST)
    at = np.linspace(0.0, efforts[-1], count + 1)[1:-1]
    piece = np.searchsorted(efforts, at, side="right") - 1
    t = (at - efforts[piece]) / effort[piece]
    # Within a piece the speed changes linearly with time.
    mean = rates[piece] + 0.5 * t * np.diff(rates)[piece]
    inner = grid[piece] + t * np.diff(times)[piece] * mean
    if breaks:
        edges = np.interp(breaks, grid, efforts)
        after = np.searchsorted(edges, at)
        ends = np.concatenate(([-np.inf], edges, [np.inf]))
        close = np.minimum(at - ends[after], ends[after + 1] - at) < 0.3 * efforts[-1] / count
        # The last one, because the piece after it may have a lower speed share.
        apart = np.append(np.diff(np.interp(breaks, grid, times)) > _APART, True)
        inner = np.union1d(inner[~close], np.array(breaks)[apart])
    return np.concatenate((grid[:1], inner, grid[-1:]))


def _deviations(
    kinematics: Scara, path: Path, side: Joints, grid: Array, squares: Array, trajectory: Trajectory
) -> Array:
    """Return the deviation of each piece's curve from the path at half its time, shape (n - 1,).

    It is infinite where the path is out of reach there.
    """
    rates, t = np.sqrt(squares), np.diff(trajectory.times)
    half = grid[:-1] + t * (3.0 * rates[:-1] + rates[1:]) / 8.0
    there = along(kinematics, path.sample(half), side).joints
    c, at = trajectory.coefficients, 0.5 * t[:, None]
    here = c[..., 0] + at * (c[..., 1] + at * (c[..., 2] + at * c[..., 3]))
    deviations = np.abs(here - there).max(axis=1)
    return np.where(np.isnan(deviations), math.inf, deviations)


def _factors_of_pieces(
    trajectory: Trajectory, kinematics: Scara, limits: Sequence[JointLimits], tool: ToolLimits
) -> Array:
    """Return the factor in time that each piece needs to keep every limit, shape (n - 1,).

    For the joints, whose accelerations are straight lines on a piece, it is exact; the tool is
    evaluated at the ends of the pieces and at samples between.
    """
    p0, v0, half, sixth = np.moveaxis(trajectory.coefficients[..., :4], -1, 0)
    t = np.diff(trajectory.times)[:, None]
    a0, a1 = 2.0 * half, 2.0 * half + 6.0 * t * sixth
    v1 = v0 + 0.5 * t * (a0 + a1)
    states = [(p0, v0, a0), (trajectory.positions[1:], v1, a1)]
    for share in _TOOL_SAMPLES:
        at = share * t
        positions = p0 + at * (v0 + at * (half + at * sixth))
        states.append((positions, v0 + at * (a0 + 3.0 * at * sixth), a0 + 6.0 * at * sixth))
    together = [np.concatenate(part) for part in zip(*states, strict=True)]
    factors = _factors(together, kinematics, limits, tool).reshape(len(states), -1).max(axis=0)
    turning = a0 * a1 < 0.0
    turn = np.where(turning, v0 + 0.5 * t * a0 * a0 / np.where(turning, a0 - a1, 1.0), 0.0)
    most = np.array([limit.max_velocity for limit in limits])
    return np.asarray(np.maximum(factors, (np.abs(turn) / most).max(axis=1)))


def _factors(
    states: Sequence[Array], kinematics: Scara, limits: Sequence[JointLimits], tool: ToolLimits
) -> Array:
    """Return the factor in time that each state needs to keep every limit, shape (n,).

    Args:
        states: Positions, velocities and accelerations of the joints, each of shape (n, 4).
        kinematics: The arm.
        limits: Of the joints.
        tool: Limits of the tool.
    """
    tool_velocity, tool_acceleration = batch.tool_motion(kinematics, *states)
    velocities = np.column_stack(
        (states[1], np.linalg.norm(tool_velocity[:, :3], axis=1), tool_velocity[:, 3])
    )
    accelerations = np.column_stack(
        (states[2], np.linalg.norm(tool_acceleration[:, :3], axis=1), tool_acceleration[:, 3])
    )
    fastest = [*(limit.max_velocity for limit in limits), tool.speed, tool.yaw_speed]
    hardest = [*(limit.max_acceleration for limit in limits), tool.acceleration]
    hardest.append(tool.yaw_acceleration)
    factors: Array = np.maximum(
        (np.abs(velocities) / fastest).max(axis=1),
        np.sqrt((np.abs(accelerations) / hardest).max(axis=1)),
    )
    return factors
