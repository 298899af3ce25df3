"""The live display of a moving arm: a table on a terminal, else one line per second."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from bioscara.cli.output.angles import RADIANS, AngleUnit
from bioscara.cli.output.console import Output, is_terminal
from bioscara.cli.output.live_view import Caption, View, cells, progress
from bioscara.report import CycleRecord


def make_view(
    output: Output,
    joints: Sequence[tuple[str, str]],
    angles: AngleUnit = RADIANS,
    caption: Caption | None = None,
) -> View:
    """Return the live table on a terminal, plain lines elsewhere.

    Args:
        output: Output to write to.
        joints: Name and unit of each joint.
        angles: Unit of the angles.
        caption: Lines to show below the table; None for none.
    """
    if is_terminal(sys.stdout):
        # Imported here: rich takes 60-200 ms to import.
        from bioscara.cli.output.live_table import TableView  # noqa: PLC0415

        return TableView(output, joints, angles=angles, caption=caption)
    return PlainView(output, joints, angles=angles)


class PlainView(View):
    """One line for all joints about once per second; arguments as :class:`View`."""

    def __init__(
        self,
        output: Output,
        joints: Sequence[tuple[str, str]],
        interval: float = 1.0,
        angles: AngleUnit = RADIANS,
    ) -> None:
        super().__init__(output, joints, interval, angles)

    def note(self, text: str) -> None:
        """Print a message."""
        self._output.line(text)

    def _draw(self, record: CycleRecord) -> None:
        joints = (
            f"{name} {' '.join(cells(joint, record.phase, unit, self._angles))}"
            for (name, unit), joint in zip(self._joints, record.joints, strict=True)
        )
        self._output.line(
            f"  {progress(record, [name for name, _ in self._joints])} | " + " | ".join(joints)
        )
