"""A run, or samples of motions, as one picture; needs matplotlib (the extra ``plot``)."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.files.whole_files import replacing
from bioscara.printing import printable
from bioscara.report.cycles import CycleHistory, Phase
from bioscara.report.statistics import measured_time, phase_mask
from bioscara.report.summary import RunSummary
from bioscara.report.text import outcome_line

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bioscara.report.picture import Picture

Array = npt.NDArray[np.float64]


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


class Curves(NamedTuple):
    """The motion of a joint; each array has one entry per sample.

    Attributes:
        name: Name of the joint.
        unit: Unit of its position.
        time: When it was measured [s].
        position: Measured.
        reference: Its reference.
        velocity: Measured.
        reference_velocity: Its reference.
    """

    name: str
    unit: str
    time: Array
    position: Array
    reference: Array
    velocity: Array
    reference_velocity: Array


def draw(title: str, time: str, joints: Sequence[Curves]) -> Picture:
    """Draw position, velocity and tracking error of every joint.

    Args:
        title: Title of the figure.
        time: Label of the axis of time.
        joints: The joints.
    """
    # Imported here: it takes a second to import.
    from bioscara.report.picture import Picture  # noqa: PLC0415

    count = len(joints)
    figure = Picture(figsize=(14, 2.2 * count + 1), layout="constrained")
    figure.suptitle(literal(title), wrap=True)
    axes = figure.subplots(count, 3, sharex=True, squeeze=False)
    for (left, middle, right), joint in zip(axes, joints, strict=True):
        left.plot(joint.time, joint.position, label="measured")
        left.plot(joint.time, joint.reference, "--", label="reference")
        left.set_ylabel(f"{joint.name} position [{joint.unit}]")
        middle.plot(joint.time, joint.velocity)
        middle.plot(joint.time, joint.reference_velocity, "--")
        middle.set_ylabel(f"velocity [{joint.unit}/s]")
        right.plot(joint.time, (joint.position - joint.reference) * 1e3, color="tab:purple")
        right.set_ylabel(f"error [m{joint.unit}]")
        for axis in (left, middle, right):
            axis.grid(visible=True, alpha=0.3)
    axes[0][0].legend()
    for axis in axes[-1]:
        axis.set_xlabel(time)
    return figure


def write(path: Path, summary: RunSummary, history: CycleHistory) -> None:
    """Draw position, velocity and tracking error of every joint of a run.

    Raises:
        OSError: The file cannot be written.
    """
    cycles = np.flatnonzero(~phase_mask(history, Phase.HOMING))
    joints = []
    for index, joint in enumerate(summary.joints):
        columns = history.columns[index]
        values = (
            np.asarray(getattr(columns, field))[cycles]
            for field in ("position", "reference", "velocity", "reference_velocity")
        )
        time = measured_time(history, index)[cycles]
        joints.append(Curves(joint.name, joint.unit, time, *values))
    figure = draw(
        f"{summary.title} on {summary.arm}: {outcome_line(summary)}",
        "time in the trajectory [s]",
        joints,
    )
    for axis in figure.axes:
        axis.axvspan(0.0, np.nan_to_num(summary.planned_duration), color="tab:gray", alpha=0.08)
    save(figure, path, dpi=110)
