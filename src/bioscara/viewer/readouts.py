"""The numbers of the page as HTML: joints within their ranges, tool, clearance.

Angles are in degrees and lengths in millimetres, for reading.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from bioscara.kinematics import Pose, PositionLimits
from bioscara.planning.collision.scene import NearestPair
from bioscara.printing import printable

NEAR_LIMIT = 0.05
"""Share of a joint's range at each end within which its position is shown as near the limit."""
_ROUNDING = 1e-6
"""Excess over a limit that still counts as at the limit [rad or m]."""
_FREE, _NEAR, _BEYOND = "#2e7d4f", "#d07000", "#c62828"
_BAR = "position:relative;height:8px;border-radius:4px;background:#e3e7ec;min-width:70px"
_CELL = "padding:1px 6px 1px 0;white-space:nowrap"


def page(
    limits: Sequence[PositionLimits],
    joints: Sequence[float],
    tool: Pose,
    nearest: NearestPair | None,
) -> str:
    """Return all readouts.

    Args:
        limits: Limits of the joints.
        joints: Their positions [rad or m].
        tool: Pose of the tool in the base [m, rad].
        nearest: The nearest pair of bodies.
    """
    rows = "".join(map(joint_row, limits, joints))
    return text(
        f'<div style="margin-bottom:8px">{clearance(nearest)}</div>'
        f'<table style="width:100%;border-collapse:collapse">{rows}</table>'
        f'<div style="margin-top:8px">{tool_pose(tool)}</div>'
    )


def text(content: str) -> str:
    """Return HTML in the font of the readouts."""
    style = "font-size:13px;line-height:1.45;padding:4px 12px;font-variant-numeric:tabular-nums"
    return f'<div style="{style}">{content}</div>'


def plain(words: str) -> str:
    """Return text from outside as HTML."""
    return escape(printable(words))


def joint_row(limit: PositionLimits, position: float) -> str:
    """Return a joint's position, and a bar that shows it within its range."""
    color, word = _state(limit, position)
    share = (position - limit.lower) / (limit.upper - limit.lower)
    left = 100.0 * min(max(share, 0.0), 1.0)
    knob = (
        f"position:absolute;top:-2px;width:4px;height:12px;border-radius:2px;background:{color};"
        f"left:calc({left:.2f}% - 2px)"
    )
    range_ = f"{_number(limit.lower, limit.unit)} .. {quantity(limit.upper, limit.unit)}"
    return (
        f'<tr><td style="{_CELL}"><b>{limit.name}</b></td>'
        f'<td style="{_CELL};text-align:right;color:{color}">{quantity(position, limit.unit)}</td>'
        f'<td style="width:100%;padding:0 2px"><div style="{_BAR}" title="{range_}">'
        f'<div style="{knob}"></div></div></td></tr>'
        f'<tr><td></td><td style="padding:0 0 4px;color:#77808a;font-size:11px" colspan="2">'
        f'range {range_}<span style="color:{color}">{word}</span></td></tr>'
    )


def clearance(nearest: NearestPair | None) -> str:
    """Return the distance of the nearest pair, its bodies and its margin."""
    if nearest is None:
        return "clearance: nothing to collide with"
    link, other = plain(nearest.link), plain(nearest.other)
    margin = f"margin {1e3 * nearest.margin:.1f} mm"
    close = nearest.distance < nearest.margin
    color = _BEYOND if close else "inherit"
    if nearest.distance < 0.0:
        words = f"{link} is inside {other}" if link != other else "bodies overlap"
    else:
        words = f"{link} to {other}"
    return (
        f'clearance <b style="font-size:16px;color:{color}">{length(nearest.distance)}</b><br>'
        f"{words} (red), {margin}{', too near' if close else ''}"
    )


def tool_pose(tool: Pose) -> str:
    """Return the pose of the tool."""
    x, y, z = (f"{1e3 * value:z.1f}" for value in tool[:3])
    return f"tool x {x}, y {y}, z {z} mm, yaw {math.degrees(tool.yaw):z.1f}°"


def quantity(value: float, unit: str) -> str:
    """Return a position of a joint with its unit: degrees for rad, millimetres for m."""
    return _number(value, unit) + ("°" if unit == "rad" else " mm")


def length(value: float) -> str:
    """Return a length [m] in millimetres."""
    return f"{1e3 * value:z.1f} mm"


def _number(value: float, unit: str) -> str:
    return f"{math.degrees(value) if unit == 'rad' else 1e3 * value:z.1f}"


def _state(limit: PositionLimits, position: float) -> tuple[str, str]:
    """Return the colour of a position and a word on it."""
    if not limit.lower - _ROUNDING <= position <= limit.upper + _ROUNDING:
        return _BEYOND, ", beyond the limit"
    room = min(position - limit.lower, limit.upper - position)
    if room < NEAR_LIMIT * (limit.upper - limit.lower):
        unit = limit.unit
        return _NEAR, f", {quantity(max(room, 0.0), unit)} from the limit"
    return _FREE, ""
