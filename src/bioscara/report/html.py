"""The run as one HTML page that needs no network: facts, tracking table, charts (uPlot)."""

from __future__ import annotations

import json
import re
from html import escape
from importlib.resources import files
from math import isnan

import numpy as np
from numpy.typing import NDArray

from bioscara.printing import printable
from bioscara.report.cycles import CycleHistory, Phase
from bioscara.report.statistics import loop_statistics, measured_time, phase_mask, tracking
from bioscara.report.summary import RunSummary
from bioscara.report.text import TRACKING, duration_line, loop_facts, outcome_line, tracking_cells

MAX_POINTS = 4000
"""Points per curve; with more cycles, each point is the worst of several cycles."""


def render(summary: RunSummary, history: CycleHistory) -> str:
    """Return the page; all external text is escaped."""
    moving = np.flatnonzero(~phase_mask(history, Phase.HOMING))
    shown = _thin(history, moving)
    values = {
        "title": _text(f"{summary.title} on {summary.arm}"),
        "arm": _text(f"{summary.started:%Y-%m-%d %H:%M:%S %z}, bioscara {summary.version}"),
        "outcome": _text(outcome_line(summary)),
        "outcome_class": summary.outcome.value,
        "facts": _facts(summary, history),
        "table_head": _row("th", ("joint", *TRACKING)),
        "table_body": "".join(
            _row("td", (joint.name, *tracking_cells(tracking(history, index), joint.unit)))
            for index, joint in enumerate(summary.joints)
        ),
        "shown": _shown(len(shown), len(moving)),
        "data": _data(summary, history, shown),
        "page_css": _resource("page.css"),
        "axis_js": _resource("axis.js"),
        "page_js": _resource("page.js"),
        "uplot_css": _resource("uplot/uPlot.min.css"),
        "uplot_js": _resource("uplot/uPlot.iife.min.js"),
    }
    # One pass: inserted text is not searched for placeholders again.
    return re.sub(r"\{\{(\w+)\}\}", lambda match: values[match[1]], _resource("page.html"))


def _resource(name: str) -> str:
    return files("bioscara.report").joinpath(name).read_text("utf-8")


def _facts(summary: RunSummary, history: CycleHistory) -> str:
    facts = [
        ("arm", summary.arm),
        ("trajectory", summary.source),
        ("duration", duration_line(summary, history)),
    ]
    facts += loop_facts(loop_statistics(history))
    facts += [("fault", text) for text in summary.faults]
    facts += [("measured", text) for text in summary.measured]
    facts += [("note", text) for text in summary.notes]
    facts += [(joint.name, f"{joint.address:#04x}, {joint.firmware}") for joint in summary.joints]
    return "".join(f"<dt>{_text(name)}</dt><dd>{_text(text)}</dd>" for name, text in facts)


def _text(text: str) -> str:
    return escape(printable(text))


def _row(tag: str, cells: tuple[str, ...]) -> str:
    return "<tr>" + "".join(f"<{tag}>{_text(cell)}</{tag}>" for cell in cells) + "</tr>"


def _shown(shown: int, total: int) -> str:
    if shown == total:
        return f"All {total} cycles are shown."
    return f"{shown} of {total} cycles are shown, of each group the one with the largest error."


def _thin(history: CycleHistory, cycles: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return at most about MAX_POINTS of ``cycles``, of each group the one with the worst error."""
    size = -(-len(cycles) // MAX_POINTS)
    if size <= 1:
        return cycles
    error = np.zeros(len(cycles))
    for column in history.columns:
        joint = np.abs(np.asarray(column.position) - np.asarray(column.reference))[cycles]
        scale = np.nanmax(joint) if np.isfinite(joint).any() else 0.0
        if scale > 0.0:
            error = np.maximum(error, np.nan_to_num(joint / scale))
    groups = np.arange(0, len(cycles), size)
    worst = [int(start + np.argmax(error[start : start + size])) for start in groups]
    return cycles[worst]


def _data(summary: RunSummary, history: CycleHistory, cycles: NDArray[np.intp]) -> str:
    joints = []
    for index, joint in enumerate(summary.joints):
        columns = history.columns[index]
        position, reference = np.asarray(columns.position), np.asarray(columns.reference)
        joints.append(
            {
                "name": joint.name,
                "unit": joint.unit,
                "time": _numbers(measured_time(history, index)[cycles]),
                "position": _numbers(position[cycles]),
                "reference": _numbers(reference[cycles]),
                "velocity": _numbers(np.asarray(columns.velocity)[cycles]),
                "reference_velocity": _numbers(np.asarray(columns.reference_velocity)[cycles]),
                "error": _numbers((position - reference)[cycles] * 1e3),
            }
        )
    data = {
        "end": 0.0 if isnan(summary.planned_duration) else summary.planned_duration,
        "joints": joints,
        "time": _numbers(np.asarray(history.trajectory_time)[cycles]),
        "bus_time": _numbers(np.asarray(history.bus_time)[cycles] * 1e3),
        "late": _numbers(np.asarray(history.late)[cycles] * 1e3),
    }
    # Only "</" could end the surrounding script element.
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def _numbers(values: NDArray[np.float64]) -> list[float | None]:
    return [float(f"{value:.7g}") if np.isfinite(value) else None for value in values.tolist()]
