"""What live displays of a moving arm have in common: when they draw, and the words they show."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from math import isnan

from bioscara.cli.output.angles import RADIANS, AngleUnit
from bioscara.cli.output.console import Output
from bioscara.protocol import Flags
from bioscara.report import CycleRecord, JointRecord, Phase, SampleQuality

Caption = Callable[[CycleRecord], Sequence[str]]
"""Returns lines about a cycle, to be shown below the joints."""

_REST = {"rad": 2e-3, "m": 2e-4}
"""Speed below which a joint is shown as holding [rad/s, m/s]: ripple of its speed filter."""


class View(ABC):
    """Shows the progress of a run; called from one thread.

    Args:
        output: Output to write to.
        joints: Name and unit of each joint.
        interval: Minimum time between two updates [s].
        angles: Unit of the angles.
        caption: Lines for a terminal; None for none.
    """

    def __init__(
        self,
        output: Output,
        joints: Sequence[tuple[str, str]],
        interval: float,
        angles: AngleUnit = RADIANS,
        caption: Caption | None = None,
    ) -> None:
        self._output, self._joints, self._interval = output, joints, interval
        self._angles, self._caption = angles, caption
        self._shown_at = -interval
        self._pending: CycleRecord | None = None

    def phase(self, text: str) -> None:
        """Report the begin of another phase of the run."""
        self.note(text)

    def cycle(self, record: CycleRecord) -> None:
        """Accept the latest cycle; it is shown if the next update is due."""
        now = time.monotonic()
        self._pending = record
        if now - self._shown_at >= self._interval:
            self._shown_at = now
            self._show()

    def close(self) -> None:
        """Show the last state and release the terminal."""
        self._show()

    def _show(self) -> None:
        record, self._pending = self._pending, None
        if record is not None:
            self._draw(record)

    @abstractmethod
    def note(self, text: str) -> None:
        """Print a message that remains visible."""

    @abstractmethod
    def _draw(self, record: CycleRecord) -> None:
        """Show a cycle."""


def state_word(record: JointRecord, phase: Phase, unit: str) -> str:
    """Return the state of a joint in one or two words."""
    flags = Flags(record.flags)
    if record.quality is SampleQuality.STALE:
        return "no answer"
    for flag, word in ((Flags.FAULT, "FAULT"), (Flags.STALL, "STALLED")):
        if flags & flag:
            return word
    if phase is Phase.HOMING:
        if flags & Flags.BUSY:
            return "homing"
        return "not homed" if flags & Flags.NOTHOMED else "homed"
    if flags & Flags.NOTENABLED:
        return "disabled"
    return "moving" if abs(record.velocity) > _REST[unit] else "holding"


def cells(
    record: JointRecord, phase: Phase, unit: str, angles: AngleUnit = RADIANS
) -> tuple[str, str, str, str]:
    """Return state, position, velocity and load of a joint as texts."""
    return (
        state_word(record, phase, unit),
        "unknown" if isnan(record.position) else angles.quantity(record.position, unit),
        "unknown" if isnan(record.velocity) else angles.quantity(record.velocity, unit, "/s"),
        "-" if isnan(record.load) else f"{record.load:.0f} %",
    )


def progress(record: CycleRecord, names: Iterable[str]) -> str:
    """Return phase and time of the run, in the arm's time; of homing joint and share as well."""
    shown = record.start if isnan(record.trajectory_time) else record.trajectory_time
    if record.phase is not Phase.HOMING:
        return f"{record.phase.value} {shown:7.2f} s"
    joints = zip(names, record.joints, strict=True)
    moving = [name for name, joint in joints if Flags(joint.flags) & Flags.BUSY]
    share = [] if isnan(record.progress) else [f"{record.progress:4.0%}"]
    return " ".join([record.phase.value, *moving, *share, f"{shown:7.2f} s"])
