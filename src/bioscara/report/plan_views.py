"""The path of the tool in the picture of a plan: top view and height, with the zones."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.kinematics import Pose, Scara
from bioscara.planning.collision.scene import Scene, Zone

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = npt.NDArray[np.float64]

FREE = Scene()
"""A scene without zones and table."""
LEAST = 0.01
"""Smallest range of an axis that no limit scales [unit of the axis]."""
_KEEP_OUT, _KEEP_IN, _TABLE = "tab:red", "tab:green", "saddlebrown"
_MARGIN = 0.02
"""Minimum margin of the axis above and below the path [m]."""


class ToolPath(NamedTuple):
    """The path of an arm.

    Attributes:
        ends: Joint positions at the start and at the end [rad, m, rad, rad], shape (2, 4).
        poses: Tool poses in the base along the path: x, y, z [m] and yaw [rad], shape (n, 4).
    """

    ends: Array
    poses: Array


def draw_from_above(axis: Axes, path: ToolPath, kinematics: Scara, scene: Scene) -> None:
    """Draw the path of the tool, the arm at both of its ends, and the borders of the zones."""
    l1, l2, _ = kinematics.geometry
    reach = 1.2 * (l1 + l2 + math.hypot(kinematics.tool.x, kinematics.tool.y))
    axis.update_datalim(
        [(kinematics.base.x + side, kinematics.base.y + side) for side in (-reach, reach)]
    )
    turns = np.linspace(0.0, 2.0 * np.pi, 181)
    for radius in (l1 + l2, abs(l1 - l2)):
        axis.plot(
            kinematics.base.x + radius * np.cos(turns),
            kinematics.base.y + radius * np.sin(turns),
            color="0.75",
            linewidth=1.0,
            linestyle=":",
            label="wrist's reach" if radius == l1 + l2 else None,
        )
    for zone in scene.zones:
        _draw_border(axis, zone, kinematics.base)
    for row, color, name in ((0, "tab:green", "start"), (-1, "tab:orange", "goal")):
        chain = _chain(kinematics, path.ends[row], path.poses[row])
        axis.plot(*chain, "-o", color=color, alpha=0.45, linewidth=5.0, markersize=7.0)
        axis.plot(*chain[:, -1], "o", color=color, markersize=9.0, label=name)
    axis.plot(path.poses[:, 0], path.poses[:, 1], color="black", linewidth=2.0, label="tool")
    axis.set_aspect("equal", adjustable="datalim")
    axis.grid(visible=True, alpha=0.3)
    axis.set_title("from above" + ("  (red: keep out, green: keep in)" if scene.zones else ""))
    axis.set_xlabel("x [m]")
    axis.set_ylabel("y [m]")
    axis.legend(loc="upper center", ncols=4, fontsize=9)


def draw_height(axis: Axes, path: ToolPath, kinematics: Scara, scene: Scene) -> None:
    """Draw the height of the tool along its path, and the zones that it passes over or under."""
    steps = np.linalg.norm(np.diff(path.poses[:, :2], axis=0), axis=1)
    along, height = np.concatenate(((0.0,), np.cumsum(steps))), path.poses[:, 2]
    axis.plot(along, height, color="black")
    places = _in_base(path.poses[:, :2], kinematics.base)
    low, high = float(height.min()), float(height.max())
    if scene.table_height is not None:
        top = kinematics.base.z + scene.table_height
        axis.axhline(top, color=_TABLE, linewidth=3.0)
        low, high = min(low, top), max(high, top)
    for zone in scene.zones:
        bottom, top = (kinematics.base.z + edge for edge in (zone.shape.low, zone.shape.high))
        within = zone.shape.covers(places)
        if zone.keep_in:
            for edge in (bottom, top):
                axis.plot(along, np.where(within, edge, np.nan), color=_KEEP_IN, linestyle="--")
        elif within.any():
            axis.fill_between(along, bottom, top, where=within, color=_KEEP_OUT, alpha=0.3)
            low, high = min(low, bottom), max(high, top)
    axis.grid(visible=True, alpha=0.3)
    table = "" if scene.table_height is None else "  (brown: table)"
    axis.set_title("height along the path" + table)
    axis.set_xlabel("distance along the path from above [m]")
    axis.set_ylabel("z [m]")
    if scene != FREE:
        # The borders of a cell may be far away; they are visible only if they are near.
        axis.set_ylim(low - _MARGIN, high + _MARGIN)
    widen(axis, LEAST)
    # The path of a vertical motion has no length from above, but for rounding errors.
    axis.set_xlim(_widened(axis.get_xlim(), LEAST))


def widen(axis: Axes, least: float) -> None:
    """Show at least ``least`` from bottom to top, so that rounding errors appear as rest."""
    axis.set_ylim(_widened(axis.get_ylim(), least))


def _widened(limits: tuple[float, float], least: float) -> tuple[float, float]:
    low, high = limits
    missing = max(least - (high - low), 0.0)
    return low - 0.5 * missing, high + 0.5 * missing


def _draw_border(axis: Axes, zone: Zone, base: Pose) -> None:
    """Draw a zone in the top view, with its name and, unless it is for all links, its links."""
    from matplotlib.patches import Polygon  # noqa: PLC0415

    rows = _in_world(zone.shape.outline(), base)
    x, y = rows.T
    if zone.keep_in:
        border = Polygon(rows, facecolor="none", edgecolor=_KEEP_IN, linewidth=2.0, linestyle="--")
    else:
        border = Polygon(rows, facecolor=_KEEP_OUT, edgecolor=_KEEP_OUT, alpha=0.3, linewidth=1.5)
    # Not as a patch: the view would extend to it, and the arm appear small in a large cell.
    axis.add_artist(border)
    name = zone.name + (f" ({', '.join(zone.links)})" if zone.links else "")
    # Above a keep-in zone and below any other: the arm is not drawn there.
    at, side = (y.argmax(), "bottom") if zone.keep_in else (y.argmin(), "top")
    color = _KEEP_IN if zone.keep_in else _KEEP_OUT
    axis.annotate(
        name, (x[at] if zone.keep_in else x.mean(), y[at]), (0, 3 if zone.keep_in else -3),
        textcoords="offset points", ha="center", va=side, fontsize=9, color=color,
        parse_math=False, annotation_clip=True, clip_on=True, in_layout=False,
    )  # fmt: skip


def _in_world(places: Array, base: Pose) -> Array:
    cos, sin = math.cos(base.yaw), math.sin(base.yaw)
    world: Array = places @ np.array(((cos, sin), (-sin, cos))) + np.array((base.x, base.y))
    return world


def _in_base(places: Array, base: Pose) -> Array:
    cos, sin = math.cos(base.yaw), math.sin(base.yaw)
    local: Array = (places - np.array((base.x, base.y))) @ np.array(((cos, -sin), (sin, cos)))
    return local


def _chain(kinematics: Scara, joints: Array, pose: Array) -> Array:
    """Return column, elbow, wrist and tool in the top view, shape (2, 4)."""
    l1, l2, _ = kinematics.geometry
    first = kinematics.base.yaw + joints[0]
    second = first + joints[2]
    elbow = np.array(
        (kinematics.base.x + l1 * math.cos(first), kinematics.base.y + l1 * math.sin(first))
    )
    wrist = elbow + l2 * np.array((math.cos(second), math.sin(second)))
    return np.array(((kinematics.base.x, kinematics.base.y), elbow, wrist, pose[:2])).T
