"""Statistics of a run: tracking error per joint, timing of the bus and of the loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bioscara.report.cycles import CycleHistory, Phase, SampleQuality

LOOP = (Phase.APPROACH, Phase.TRAJECTORY, Phase.SETTLING, Phase.STOPPING)
"""Phases in which the loop runs at a fixed rate; homing is only polled."""


@dataclass(frozen=True, slots=True)
class Tracking:
    """Tracking error of one joint: measured minus reference position at the same time.

    Attributes:
        samples: Number of good samples; if there are none, the numbers below are NaN.
        max_error: Largest absolute error [rad or m].
        max_error_time: Time of the largest error [s in the trajectory].
        rms_error: Root of the mean square error [rad or m].
        final_error: Absolute error of the last good sample after settling [rad or m].
        max_speed: Largest measured speed [rad/s or m/s].
    """

    samples: int
    max_error: float
    max_error_time: float
    rms_error: float
    final_error: float
    max_speed: float


@dataclass(frozen=True, slots=True)
class LoopStatistics:
    """Timing of the loop and the bus while setpoints were streamed, in the arm's time.

    Attributes:
        cycles: Number of cycles.
        period_mean: Mean time from cycle to cycle [s]; NaN with fewer than two cycles.
        period_max: Longest time from cycle to cycle [s].
        late_max: Largest delay of a cycle's begin against its schedule [s].
        bus_time_mean: Mean duration of the exchange with all joints [s].
        bus_time_max: Longest duration of that exchange [s].
        retries: Number of repeated exchanges.
        stale: Number of joint samples taken from an earlier cycle because an exchange failed.
    """

    cycles: int
    period_mean: float
    period_max: float
    late_max: float
    bus_time_mean: float
    bus_time_max: float
    retries: int
    stale: int


def phase_mask(history: CycleHistory, *phases: Phase) -> NDArray[np.bool_]:
    """Return which cycles belong to ``phases``, shape (cycles,)."""
    return np.fromiter((phase in phases for phase in history.phases), bool, len(history))


def tracking(history: CycleHistory, joint: int) -> Tracking:
    """Return the tracking error of the joint of this index."""
    columns = history.columns[joint]
    good = np.asarray(columns.quality) == SampleQuality.GOOD
    error = np.asarray(columns.position) - np.asarray(columns.reference)
    good &= np.isfinite(error)
    moving = good & phase_mask(history, Phase.TRAJECTORY)
    ended = np.flatnonzero(good & phase_mask(history, Phase.TRAJECTORY, Phase.SETTLING))
    if not moving.any():
        nan = float("nan")
        return Tracking(0, nan, nan, nan, nan, nan)
    chosen = error[moving]
    worst = int(np.argmax(np.abs(chosen)))
    return Tracking(
        samples=len(chosen),
        max_error=float(abs(chosen[worst])),
        max_error_time=float(measured_time(history, joint)[moving][worst]),
        rms_error=float(np.sqrt(np.mean(chosen**2))),
        final_error=float(abs(error[ended[-1]])),
        max_speed=float(np.max(np.abs(np.asarray(columns.velocity)[moving]))),
    )


def measured_time(history: CycleHistory, joint: int) -> NDArray[np.float64]:
    """Return the time of each sample of a joint [s in the trajectory], shape (cycles,)."""
    offset = np.asarray(history.columns[joint].time) - np.asarray(history.start)
    return np.asarray(history.trajectory_time + offset, dtype=np.float64)


def duration(history: CycleHistory, *phases: Phase) -> float:
    """Return the time from the first to the last cycle of ``phases`` [s]; NaN if there is none."""
    start = np.asarray(history.start)[phase_mask(history, *phases)]
    return float(start[-1] - start[0]) if len(start) else float("nan")


def loop_statistics(history: CycleHistory) -> LoopStatistics:
    """Return the timing of the loop and the bus."""
    nan = float("nan")
    mask = phase_mask(history, *LOOP)
    cycles = int(mask.sum())
    if cycles == 0:
        return LoopStatistics(0, nan, nan, nan, nan, nan, 0, 0)
    period = np.diff(np.asarray(history.start)[mask])
    bus_time = np.asarray(history.bus_time)[mask]
    stale = sum(
        int((np.asarray(column.quality)[mask] == SampleQuality.STALE).sum())
        for column in history.columns
    )
    return LoopStatistics(
        cycles=cycles,
        period_mean=float(period.mean()) if cycles > 1 else nan,
        period_max=float(period.max()) if cycles > 1 else nan,
        late_max=float(np.asarray(history.late)[mask].max()),
        bus_time_mean=float(bus_time.mean()),
        bus_time_max=float(bus_time.max()),
        retries=int(np.asarray(history.retries)[mask].sum()),
        stale=stale,
    )
