"""A planned motion as one picture; needs matplotlib (the extra ``plot``)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.errors import InvalidArgumentError, TrajectoryError
from bioscara.extras import install
from bioscara.kinematics import Scara, batch
from bioscara.planning import Trajectory
from bioscara.planning.collision.scene import Scene
from bioscara.planning.limits import JointLimits, ToolLimits
from bioscara.printing import printable
from bioscara.report.plan_views import FREE, LEAST, ToolPath, draw_from_above, draw_height, widen
from bioscara.report.png import available, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from bioscara.report.picture import Picture

Array = npt.NDArray[np.float64]

_STEP, _SAMPLES = 1e-3, 5000
_VALUE, _LIMIT = "tab:blue", "tab:red"
_ROUNDING = 1e-6
"""Excess over a limit that still counts as at the limit [rad or m]."""
_NEAR = 0.3
"""Share of a limit from which on the limit is drawn; below it the curve would be a flat line."""


class _MotionSamples(NamedTuple):
    """Samples of a trajectory: motion of the joints and of the tool; rows are instants."""

    times: Array
    positions: Array
    velocities: Array
    accelerations: Array
    poses: Array
    pose_rates: Array
    pose_accelerations: Array


def require_matplotlib() -> None:
    """Raise if no picture can be drawn; to be called before anything moves.

    Raises:
        InvalidArgumentError: matplotlib is not installed.
    """
    if not available():
        raise InvalidArgumentError(
            f"drawing a plan needs matplotlib, which is not installed: {install('plot')}"
        )


def write_plan(
    path: Path,
    trajectory: Trajectory,
    kinematics: Scara,
    limits: Sequence[JointLimits],
    tool: ToolLimits,
    title: str = "",
    scene: Scene = FREE,
) -> None:
    """Draw joints and tool of a planned motion with their limits, and the path among the zones.

    Args:
        path: The PNG file; an existing one is replaced.
        trajectory: Trajectory of all joints of the arm.
        kinematics: The arm with its tool.
        limits: Limits of its joints, j1 to j4.
        tool: Limits of the tool that the plan was kept to.
        title: Title of the figure.
        scene: Surroundings that the arm was kept clear of.

    Raises:
        InvalidArgumentError: matplotlib is not installed.
        TrajectoryError: The trajectory is not for the joints of the arm.
        OSError: The file cannot be written.
    """
    save(draw_plan(trajectory, kinematics, limits, tool, title, scene), path, dpi=100)


def draw_plan(
    trajectory: Trajectory,
    kinematics: Scara,
    limits: Sequence[JointLimits],
    tool: ToolLimits,
    title: str = "",
    scene: Scene = FREE,
) -> Picture:
    """Return the picture; arguments and errors as :func:`write_plan`."""
    require_matplotlib()
    # Imported here: it takes a second to import.
    from bioscara.report.picture import Picture  # noqa: PLC0415

    motion = _sampled(trajectory, kinematics)
    figure = Picture(figsize=(19, 13))
    figure.suptitle(
        f"{printable(title) or 'planned motion'}, {trajectory.duration:.3f} s  "
        "(dashed red: limits)",
        fontsize=15,
        y=0.995,
        parse_math=False,
    )
    # Fixed places: to compute them from the texts takes as long as the drawing itself.
    grid = figure.add_gridspec(
        6, 3, left=0.05, right=0.69, bottom=0.04, top=0.935, wspace=0.31, hspace=0.36
    )
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
    views = figure.add_gridspec(
        2, 1, left=0.735, right=0.995, bottom=0.04, top=0.955, hspace=0.16, height_ratios=(2.2, 1.0)
    )
    path = ToolPath(motion.positions[[0, -1]], motion.poses)
    draw_from_above(figure.add_subplot(views[0]), path, kinematics, scene)
    draw_height(figure.add_subplot(views[1]), path, kinematics, scene)
    return figure


def _sampled(trajectory: Trajectory, kinematics: Scara) -> _MotionSamples:
    names = [limit.name for limit in kinematics.limits]
    if sorted(trajectory.joint_names) != sorted(names):
        raise TrajectoryError(
            f"a picture needs a trajectory of {', '.join(names)}; this one is of "
            f"{', '.join(trajectory.joint_names)}"
        )
    count = min(max(int(trajectory.duration / _STEP) + 2, 2), _SAMPLES)
    # Exactly at its end a trajectory is at rest, irrespective of its speed just before.
    end = np.nextafter(trajectory.duration, 0.0) or _STEP
    times = np.linspace(0.0, end, count)
    order = [trajectory.joint_names.index(name) for name in names]
    positions, velocities, accelerations = (
        values[:, order] for values in trajectory.sample_many(times)
    )
    tool = batch.tool_motion(kinematics, positions, velocities, accelerations)
    return _MotionSamples(
        times, positions, velocities, accelerations, batch.forward(kinematics, positions), *tool
    )


def _draw_joint(
    axes: Sequence[Axes], motion: _MotionSamples, index: int, limit: JointLimits
) -> None:
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
        f"{low:z.3f} to {high:z.3f} within {limit.lower:.3f} to {limit.upper:.3f} {unit}",
        over=low < limit.lower - _ROUNDING or high > limit.upper + _ROUNDING,
    )
    widen(axes[0], LEAST)
    for axis, values, most, name in (
        (axes[1], motion.velocities, limit.max_velocity, f"{unit}/s"),
        (axes[2], motion.accelerations, limit.max_acceleration, f"{unit}/s²"),
    ):
        _draw_bounded(axis, motion.times, values[:, index], most, name)


def _draw_tool(axes: Sequence[Axes], motion: _MotionSamples, tool: ToolLimits) -> None:
    for column, name in enumerate("xyz"):
        axes[0].plot(motion.times, motion.poses[:, column], label=name)
    axes[0].legend(loc="best", ncols=3, fontsize=8, framealpha=0.6)
    widen(axes[0], LEAST)
    axes[0].set_ylabel("tool [m]", weight="bold")
    speed = np.linalg.norm(motion.pose_rates[:, :3], axis=1)
    acceleration = np.linalg.norm(motion.pose_accelerations[:, :3], axis=1)
    _draw_bounded(axes[1], motion.times, speed, tool.speed, "m/s", size=True)
    _draw_bounded(axes[2], motion.times, acceleration, tool.acceleration, "m/s²", size=True)


def _draw_yaw(axes: Sequence[Axes], motion: _MotionSamples, tool: ToolLimits) -> None:
    axes[0].plot(motion.times, motion.poses[:, 3], color=_VALUE)
    axes[0].set_ylabel("tool yaw [rad]", weight="bold")
    widen(axes[0], LEAST)
    rate, acceleration = motion.pose_rates[:, 3], motion.pose_accelerations[:, 3]
    _draw_bounded(axes[1], motion.times, rate, tool.yaw_speed, "rad/s")
    _draw_bounded(axes[2], motion.times, acceleration, tool.yaw_acceleration, "rad/s²")


def _draw_bounded(
    axis: Axes, times: Array, values: Array, bound: float, unit: str, *, size: bool = False
) -> None:
    """Draw a velocity or acceleration, its bounds in both directions, and the share used."""
    peak = float(np.abs(values).max())
    axis.plot(times, values, color=_VALUE)
    axis.set_ylabel(f"[{unit}]")
    if not math.isfinite(bound):
        _caption(axis, f"at most {peak:.3f} {unit}, no limit", over=False)
        widen(axis, LEAST)
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
    widen(axis, 0.01 * bound)


def _limit_line(axis: Axes, value: float) -> None:
    axis.axhline(value, color=_LIMIT, linestyle="--", linewidth=1.2)


def _caption(axis: Axes, text: str, *, over: bool) -> None:
    """Write the caption of a curve, highlighted if the curve exceeds its limit."""
    weight = "bold" if over else "normal"
    axis.set_title(text, fontsize=9, color=_LIMIT if over else "black", weight=weight)
