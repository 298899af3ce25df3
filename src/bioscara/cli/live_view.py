"""What a person sees while the arm moves: a live table, or a line a second."""

from __future__ import annotations

import os
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from math import isnan

from bioscara.cli.console import Output
from bioscara.protocol import Flags
from bioscara.report import CycleRecord, JointRecord, Phase, Quality

_REST = {"rad": 2e-3, "m": 2e-4}
"""Speed below which a joint is shown as standing [rad/s, m/s]: its speed filter's ripple."""


class View(ABC):
    """Shows the progress of a run; called from one thread.

    Args:
        output: Where to write.
        joints: Name and unit of each joint.
        interval: Least time between two pictures [s].
    """

    def __init__(self, output: Output, joints: Sequence[tuple[str, str]], interval: float) -> None:
        self._output, self._joints, self._interval = output, joints, interval
        self._shown_at = -interval
        self._pending: CycleRecord | None = None

    def phase(self, text: str) -> None:
        """Say that another part of the run begins."""
        self.note(text)

    def cycle(self, record: CycleRecord) -> None:
        """Take the latest cycle; it is shown if it is time for another picture."""
        now = time.monotonic()
        self._pending = record
        if now - self._shown_at >= self._interval:
            self._shown_at = now
            self._show()

    def close(self) -> None:
        """Show the last state and let go of the terminal."""
        self._show()

    def _show(self) -> None:
        record, self._pending = self._pending, None
        if record is not None:
            self._draw(record)

    @abstractmethod
    def note(self, text: str) -> None:
        """Say something that stays readable."""

    @abstractmethod
    def _draw(self, record: CycleRecord) -> None:
        """Show a cycle."""


def make_view(output: Output, joints: Sequence[tuple[str, str]]) -> View:
    """Return the live table on a terminal, plain lines elsewhere.

    Args:
        output: Where to write.
        joints: Name and unit of each joint.
    """
    if sys.stdout.isatty() and os.environ.get("TERM", "dumb") != "dumb":
        # Here and not above: rich takes 60-200 ms to import.
        from bioscara.cli.live_table import TableView  # noqa: PLC0415

        return TableView(output, joints)
    return PlainView(output, joints)


def state_word(record: JointRecord, phase: Phase, unit: str) -> str:
    """Return what a joint is doing, in a word or two."""
    flags = Flags(record.flags)
    if record.quality is Quality.STALE:
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


def cells(record: JointRecord, phase: Phase, unit: str) -> tuple[str, str, str, str]:
    """Return state, position, velocity and load of a joint as texts."""
    return (
        state_word(record, phase, unit),
        "unknown" if isnan(record.position) else f"{record.position:+z.4f} {unit}",
        "unknown" if isnan(record.velocity) else f"{record.velocity:+z.4f} {unit}/s",
        "-" if isnan(record.load) else f"{record.load:.0f} %",
    )


def progress(record: CycleRecord) -> str:
    """Return how far the run is, in the arm's time."""
    shown = record.start if isnan(record.trajectory_time) else record.trajectory_time
    return f"{record.phase.value} {shown:7.2f} s"


class PlainView(View):
    """A line for all joints about once a second; arguments as :class:`View`."""

    def __init__(
        self, output: Output, joints: Sequence[tuple[str, str]], interval: float = 1.0
    ) -> None:
        super().__init__(output, joints, interval)

    def note(self, text: str) -> None:
        """Say something."""
        self._output.line(text)

    def _draw(self, record: CycleRecord) -> None:
        joints = (
            f"{name} {' '.join(cells(joint, record.phase, unit))}"
            for (name, unit), joint in zip(self._joints, record.joints, strict=True)
        )
        self._output.line(f"  {progress(record)} | " + " | ".join(joints))
