"""A planned motion as one picture; needs matplotlib (``pip install 'bioscara[plot]'``)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.errors import InvalidArgumentError, TrajectoryError
from bioscara.kinematics import Scara, batch
from bioscara.planning import Trajectory
from bioscara.planning.limits import JointLimits
from bioscara.report.png import available

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]

_STEP, _SAMPLES = 1e-3, 5000
_EACH = "nij,nj->ni"  # a matrix times a vector, for each instant
_VALUE, _LIMIT = "tab:blue", "tab:red"
_ROUNDING = 1e-6
"""How far beyond a limit still counts as at it [rad or m]."""
_LEAST = 0.01
"""Smallest range that is shown where no limit gives a scale [unit of the axis]."""
_NEAR = 0.3
"""Share of a limit from which the limit is drawn; below it the curve would be a flat line."""


class ToolBounds(NamedTuple):
    """What the tool keeps to; None for no bound.

    Attributes:
        speed: [m/s].
        acceleration: [m/s^2].
        yaw_speed: [rad/s].
        yaw_acceleration: [rad/s^2].
    """

    speed: float | None = None
    acceleration: float | None = None
    yaw_speed: float | None = None
    yaw_acceleration: float | None = None


class _Motion(NamedTuple):
    """Samples of a trajectory: joints, and what the tool does; rows are instants."""

    times: Array
    positions: Array
    velocities: Array
    accelerations: Array
    poses: Array
    pose_rates: Array
    pose_accelerations: Array


def require_matplotlib() -> None:
    """Raise if no picture can be drawn; to be asked before anything moves.

    Raises:
        InvalidArgumentError: matplotlib is not installed.
    """
    if not available():
        raise InvalidArgumentError(
            "drawing a plan needs matplotlib, which is not installed: pip install 'bioscara[plot]'"
        )


def write_plan(
    path: Path,
    trajectory: Trajectory,
    arm: Scara,
    limits: Sequence[JointLimits],
    tool: ToolBounds,
    title: str = "",
) -> None:
    """Draw joints and tool of a planned motion against their limits, and its way from above.

    Args:
        path: The PNG file; replaced if there is one.
        trajectory: For all joints of the arm.
        arm: The arm with its tool.
        limits: Of its joints, j1 to j4.
        tool: What the tool keeps to.
        title: What stands above.

    Raises:
        InvalidArgumentError: matplotlib is not installed.
        TrajectoryError: The trajectory is not for the joints of the arm.
        OSError: The file cannot be written.
    """
    require_matplotlib()
    draw_plan(trajectory, arm, limits, tool, title).savefig(path, dpi=100, format="png")


def draw_plan(
    trajectory: Trajectory,
    arm: Scara,
    limits: Sequence[JointLimits],
    tool: ToolBounds,
    title: str = "",
) -> Figure:
    """Return the picture; arguments and errors as :func:`write_plan`."""
    # Without pyplot: no display, no global state; and it takes a second to import.
    from matplotlib import figure as figures  # noqa: PLC0415

    motion = _sampled(trajectory, arm)
    figure = figures.Figure(figsize=(19, 13), layout="constrained")
    figure.suptitle(
        f"{title or 'planned motion'}, {trajectory.duration:.3f} s  (dashed red: limits)",
        fontsize=15,
    )
    halves = figure.add_gridspec(1, 2, width_ratios=(2.3, 1.0))
    grid = halves[0].subgridspec(6, 3)
    axes = [[figure.add_subplot(grid[row, column]) for column in range(3)] for row in range(6)]
    for index, limit in enumerate(limits):
        _draw_joint(axes[index], motion, index, limit)
    _draw_tool(axes[4], motion, tool)
    _draw_yaw(axes[5], motion, tool)
    for axis in (axis for row in axes for axis in row):
        axis.grid(visible=True, alpha=0.3)
        axis.margins(x=0.0)
    for axis, heading in zip(axes[0], ("position", "velocity", "acceleration"), strict=True):
        axis.annotate(
            heading, (0.5, 1.25), xycoords="axes fraction", ha="center", weight="bold", fontsize=12
        )
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    views = halves[1].subgridspec(2, 1, height_ratios=(2.2, 1.0))
    _draw_from_above(figure.add_subplot(views[0]), motion, arm)
    _draw_height(figure.add_subplot(views[1]), motion)
    return figure


def _sampled(trajectory: Trajectory, arm: Scara) -> _Motion:
    names = [limit.name for limit in arm.limits]
    if sorted(trajectory.joint_names) != sorted(names):
        raise TrajectoryError(
            f"a picture needs a trajectory of {', '.join(names)}; this one is of "
            f"{', '.join(trajectory.joint_names)}"
        )
    count = min(max(int(trajectory.duration / _STEP) + 2, 2), _SAMPLES)
    # At its very end a trajectory is at rest, whatever speed it arrives with.
    times = np.linspace(0.0, np.nextafter(trajectory.duration, 0.0), count)
    order = [trajectory.joint_names.index(name) for name in names]
    positions, velocities, accelerations = (
        values[:, order] for values in trajectory.sample_many(times)
    )
    slopes = batch.jacobian(arm, positions)
    step = 1e-5
    bend = batch.jacobian(arm, positions + step * velocities)
    bend -= batch.jacobian(arm, positions - step * velocities)
    bend /= 2.0 * step
    return _Motion(
        times,
        positions,
        velocities,
        accelerations,
        batch.forward(arm, positions),
        np.einsum(_EACH, slopes, velocities),
        np.einsum(_EACH, slopes, accelerations) + np.einsum(_EACH, bend, velocities),
    )


def _draw_joint(axes: Sequence[Axes], motion: _Motion, index: int, limit: JointLimits) -> None:
    unit, position = limit.unit, motion.positions[:, index]
    low, high = float(position.min()), float(position.max())
    axes[0].plot(motion.times, position, color=_VALUE)
    span = limit.upper - limit.lower
    for bound in (limit.lower, limit.upper):
        if low - 0.1 * span <= bound <= high + 0.1 * span:
            _limit_line(axes[0], bound)
    axes[0].set_ylabel(f"{limit.name} [{unit}]", weight="bold")
    _caption(
        axes[0],
        f"{low:.3f} to {high:.3f} within {limit.lower:.3f} to {limit.upper:.3f} {unit}",
        over=low < limit.lower - _ROUNDING or high > limit.upper + _ROUNDING,
    )
    _widen(axes[0], _LEAST)
    for axis, values, most, name in (
        (axes[1], motion.velocities, limit.max_velocity, f"{unit}/s"),
        (axes[2], motion.accelerations, limit.max_acceleration, f"{unit}/s²"),
    ):
        _draw_bounded(axis, motion.times, values[:, index], most, name)


def _draw_tool(axes: Sequence[Axes], motion: _Motion, tool: ToolBounds) -> None:
    for column, name in enumerate("xyz"):
        axes[0].plot(motion.times, motion.poses[:, column], label=name)
    axes[0].legend(loc="best", ncols=3, fontsize=8, framealpha=0.6)
    _widen(axes[0], _LEAST)
    axes[0].set_ylabel("tool [m]", weight="bold")
    speed = np.linalg.norm(motion.pose_rates[:, :3], axis=1)
    acceleration = np.linalg.norm(motion.pose_accelerations[:, :3], axis=1)
    _draw_bounded(axes[1], motion.times, speed, tool.speed, "m/s", size=True)
    _draw_bounded(axes[2], motion.times, acceleration, tool.acceleration, "m/s²", size=True)


def _draw_yaw(axes: Sequence[Axes], motion: _Motion, tool: ToolBounds) -> None:
    axes[0].plot(motion.times, motion.poses[:, 3], color=_VALUE)
    axes[0].set_ylabel("tool yaw [rad]", weight="bold")
    _widen(axes[0], _LEAST)
    rate, acceleration = motion.pose_rates[:, 3], motion.pose_accelerations[:, 3]
    _draw_bounded(axes[1], motion.times, rate, tool.yaw_speed, "rad/s")
    _draw_bounded(axes[2], motion.times, acceleration, tool.yaw_acceleration, "rad/s²")


def _draw_bounded(
    axis: Axes, times: Array, values: Array, bound: float | None, unit: str, *, size: bool = False
) -> None:
    """Draw a velocity or acceleration, its bound either way, and how much of it is used."""
    peak = float(np.abs(values).max())
    axis.plot(times, values, color=_VALUE)
    axis.set_ylabel(f"[{unit}]")
    if bound is None or not math.isfinite(bound):
        _caption(axis, f"at most {peak:.3f} {unit}, no limit", over=False)
        _widen(axis, _LEAST)
        return
    _caption(
        axis,
        f"at most {peak:.3f} of {bound:g} {unit} ({100.0 * peak / bound:.0f} %)",
        over=peak > bound * (1.0 + 1e-6),
    )
    if peak >= _NEAR * bound:
        _limit_line(axis, bound)
        if not size:
            _limit_line(axis, -bound)
    _widen(axis, 0.01 * bound)


def _limit_line(axis: Axes, value: float) -> None:
    axis.axhline(value, color=_LIMIT, linestyle="--", linewidth=1.2)


def _caption(axis: Axes, text: str, *, over: bool) -> None:
    """Write what a curve comes to, conspicuously where it is over its limit."""
    weight = "bold" if over else "normal"
    axis.set_title(text, fontsize=9, color=_LIMIT if over else "black", weight=weight)


def _widen(axis: Axes, least: float) -> None:
    """Show at least ``least`` from bottom to top, so that rounding looks like rest."""
    low, high = axis.get_ylim()
    if high - low < least:
        middle = 0.5 * (low + high)
        axis.set_ylim(middle - 0.5 * least, middle + 0.5 * least)


def _draw_from_above(axis: Axes, motion: _Motion, arm: Scara) -> None:
    l1, l2, _ = arm.geometry
    turns = np.linspace(0.0, 2.0 * np.pi, 181)
    for radius in (l1 + l2, abs(l1 - l2)):
        axis.plot(
            arm.base.x + radius * np.cos(turns),
            arm.base.y + radius * np.sin(turns),
            color="0.75",
            linewidth=1.0,
            linestyle=":",
            label="wrist's reach" if radius == l1 + l2 else None,
        )
    for row, color, name in ((0, "tab:green", "start"), (-1, "tab:orange", "goal")):
        chain = _chain(arm, motion.positions[row], motion.poses[row])
        axis.plot(*chain, "-o", color=color, alpha=0.45, linewidth=5.0, markersize=7.0)
        axis.plot(*chain[:, -1], "o", color=color, markersize=9.0, label=name)
    axis.plot(motion.poses[:, 0], motion.poses[:, 1], color="black", linewidth=2.0, label="tool")
    axis.set_aspect("equal", adjustable="datalim")
    axis.grid(visible=True, alpha=0.3)
    axis.set_title("from above")
    axis.set_xlabel("x [m]")
    axis.set_ylabel("y [m]")
    axis.legend(loc="upper center", ncols=4, fontsize=9)


def _chain(arm: Scara, joints: Array, pose: Array) -> Array:
    """Return column, elbow, wrist and tool from above, shape (2, 4)."""
    l1, l2, _ = arm.geometry
    first = arm.base.yaw + joints[0]
    second = first + joints[2]
    elbow = np.array((arm.base.x + l1 * math.cos(first), arm.base.y + l1 * math.sin(first)))
    wrist = elbow + l2 * np.array((math.cos(second), math.sin(second)))
    return np.array(((arm.base.x, arm.base.y), elbow, wrist, pose[:2])).T


def _draw_height(axis: Axes, motion: _Motion) -> None:
    steps = np.linalg.norm(np.diff(motion.poses[:, :2], axis=0), axis=1)
    axis.plot(np.concatenate(((0.0,), np.cumsum(steps))), motion.poses[:, 2], color="black")
    axis.grid(visible=True, alpha=0.3)
    axis.set_title("height along the way")
    axis.set_xlabel("way of the tool from above [m]")
    axis.set_ylabel("z [m]")
    _widen(axis, _LEAST)
