"""The report as text, for a terminal and for ``report.txt``."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan

from bioscara.printing import printable
from bioscara.report.cycles import CycleHistory, Phase
from bioscara.report.statistics import (
    LOOP,
    LoopStatistics,
    Tracking,
    duration,
    loop_statistics,
    tracking,
)
from bioscara.report.summary import JointInfo, Outcome, RunSummary

TRACKING = ("error max", "at", "error rms", "at the end", "speed max", "samples")
"""Headings of the cells of :func:`tracking_cells`."""


def render(summary: RunSummary, history: CycleHistory) -> str:
    """Return the report in lines that fit in 80 characters, except for names and messages."""
    lines = [
        f"bioscara {summary.version}: {summary.title}",
        f"  arm         {summary.arm}",
        f"  trajectory  {summary.source}",
        f"  started     {summary.started:%Y-%m-%d %H:%M:%S %z}",
        f"  outcome     {outcome_line(summary)}",
        *_list("duration", duration_line(summary, history).split("; ")),
        "",
        *tracking_table(summary, history),
        "",
        *(
            line
            for name, fact in loop_facts(loop_statistics(history))
            for line in _list(name, fact.split("; "))
        ),
        "",
        *(_list("measured", summary.measured) if summary.measured else ()),
        *_list("faults", summary.faults),
        *_list("notes", summary.notes),
        "",
        *_table(
            [("joint", "address", "firmware")] + [_joint_row(joint) for joint in summary.joints]
        ),
    ]
    return "\n".join(map(printable, lines)) + "\n"


def outcome_line(summary: RunSummary) -> str:
    """Return how the run ended and why."""
    if summary.outcome is Outcome.COMPLETED:
        return "completed"
    return f"{summary.outcome.value.upper()}: {summary.message}"


def duration_line(summary: RunSummary, history: CycleHistory) -> str:
    """Return the durations of the trajectory and of the parts of the run, in words."""
    homing, motion = duration(history, Phase.HOMING), duration(history, *LOOP)
    return (
        f"trajectory {seconds(summary.planned_duration)}; homing took {seconds(homing)}, "
        f"motion {seconds(motion)} of the arm's time"
    )


def tracking_table(summary: RunSummary, history: CycleHistory) -> list[str]:
    """Return the tracking errors as lines of a table."""
    rows = [("tracking", *TRACKING)]
    for index, joint in enumerate(summary.joints):
        rows.append((joint.name, *tracking_cells(tracking(history, index), joint.unit)))
    return _table(rows)


def tracking_cells(result: Tracking, unit: str) -> tuple[str, str, str, str, str, str]:
    """Return one joint's errors in m(rad) or mm, time and speed with units, and the count."""
    if not result.samples:
        return ("-", "-", "-", "-", "-", "0")
    return (
        small(result.max_error, unit),
        f"{result.max_error_time:.2f} s",
        small(result.rms_error, unit),
        small(result.final_error, unit),
        f"{result.max_speed:.4f} {unit}/s",
        str(result.samples),
    )


def loop_facts(loop: LoopStatistics) -> list[tuple[str, str]]:
    """Return the statistics of loop and bus, each with its name."""
    if not loop.cycles:
        return [("bus", "no setpoint was streamed")]
    return [
        (
            "loop",
            f"{loop.cycles} cycles, period {milli(loop.period_mean)} mean, "
            f"{milli(loop.period_max)} max; latest begin {milli(loop.late_max)} after schedule",
        ),
        (
            "bus",
            f"{milli(loop.bus_time_mean)} mean, {milli(loop.bus_time_max)} max per cycle; "
            f"{loop.retries} retries, {loop.stale} stale samples",
        ),
    ]


def small(value: float, unit: str) -> str:
    """Return a small angle or length in thousandths of its unit, ``mrad`` or ``mm``."""
    return f"{value * 1e3:.3f} m{unit}"


def milli(value: float) -> str:
    """Return a time in milliseconds; a dash if it is unknown."""
    return "-" if isnan(value) else f"{value * 1e3:.2f} ms"


def seconds(value: float) -> str:
    """Return a time in seconds; a dash if it is unknown."""
    return "-" if isnan(value) else f"{value:.2f} s"


def _joint_row(joint: JointInfo) -> tuple[str, str, str]:
    return (joint.name, f"{joint.address:#04x}", joint.firmware)


def _list(title: str, items: Sequence[str]) -> list[str]:
    first, *others = items or ("none",)
    return [f"  {title:<11} {first}", *(f"  {'':<11} {item}" for item in others)]


def _table(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  "
        + "  ".join(
            cell.ljust(width) if column == 0 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
