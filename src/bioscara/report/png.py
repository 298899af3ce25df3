"""The run as one picture; needs matplotlib (the extra ``plot``)."""

from __future__ import annotations

import warnings
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bioscara.printing import printable
from bioscara.report.cycles import CycleHistory, Phase
from bioscara.report.statistics import measured_time, phase_mask
from bioscara.report.summary import RunSummary
from bioscara.report.text import outcome_line
from bioscara.whole_files import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def available() -> bool:
    """Return whether matplotlib is installed."""
    return find_spec("matplotlib") is not None


def save(figure: Figure, path: Path, dpi: int) -> None:
    """Write a picture as PNG, whole or not at all.

    A character that is missing in its font is drawn as a box.

    Raises:
        OSError: The file cannot be written.
    """
    # Imported here: it takes a second to import.
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415

    figure.set_dpi(dpi)
    with warnings.catch_warnings():
        # The box shows it; a warning with this source line for each character would not help.
        warnings.filterwarnings("ignore", "Glyph .* missing from font", UserWarning)
        with replacing(path) as partial:
            # Figure.savefig would draw it twice.
            FigureCanvasAgg(figure).print_png(partial)  # type: ignore[no-untyped-call]


def literal(text: str) -> str:
    """Return a text so that matplotlib draws it as it is."""
    # Text between two dollar signs is a formula, for wrapped lines also with parse_math=False.
    return printable(text).replace("$", r"\$")


def write(path: Path, summary: RunSummary, history: CycleHistory) -> None:
    """Draw position, velocity and tracking error of every joint.

    Raises:
        OSError: The file cannot be written.
    """
    # Without pyplot: no display, no global state. Imported here: it takes a second to import.
    from matplotlib import figure as figures  # noqa: PLC0415

    count = len(summary.joints)
    figure = figures.Figure(figsize=(14, 2.2 * count + 1), layout="constrained")
    figure.suptitle(
        literal(f"{summary.title} on {summary.arm}: {outcome_line(summary)}"), wrap=True
    )
    axes = figure.subplots(count, 3, sharex=True, squeeze=False)
    cycles = np.flatnonzero(~phase_mask(history, Phase.HOMING))
    for index, joint in enumerate(summary.joints):
        columns = history.columns[index]
        time = measured_time(history, index)[cycles]
        position, reference = (
            np.asarray(columns.position)[cycles],
            np.asarray(columns.reference)[cycles],
        )
        left, middle, right = axes[index]
        left.plot(time, position, label="measured")
        left.plot(time, reference, "--", label="reference")
        left.set_ylabel(f"{joint.name} position [{joint.unit}]")
        middle.plot(time, np.asarray(columns.velocity)[cycles])
        middle.plot(time, np.asarray(columns.reference_velocity)[cycles], "--")
        middle.set_ylabel(f"velocity [{joint.unit}/s]")
        right.plot(time, (position - reference) * 1e3, color="tab:purple")
        right.set_ylabel(f"error [m{joint.unit}]")
        for axis in axes[index]:
            axis.grid(visible=True, alpha=0.3)
            axis.axvspan(0.0, summary.planned_duration, color="tab:gray", alpha=0.08)
    axes[0][0].legend()
    for axis in axes[-1]:
        axis.set_xlabel("time in the trajectory [s]")
    save(figure, path, dpi=110)
