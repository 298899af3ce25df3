"""The live table, drawn with rich."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from bioscara.cli.output.angles import RADIANS, AngleUnit
from bioscara.cli.output.console import Output
from bioscara.cli.output.live_view import Caption, View, cells, progress
from bioscara.printing import printable
from bioscara.report import CycleRecord

_COLOURS = {
    "FAULT": "bold red",
    "STALLED": "bold red",
    "no answer": "bold red",
    "not homed": "yellow",
    "homing": "cyan",
    "moving": "green",
    "disabled": "dim",
}
_NOTES = {"warning:": "yellow", "note:": "cyan"}


class _Console(Console):
    """A console that, unlike rich's, does not end the program when its reader closes the pipe."""

    def __init__(self, output: Output) -> None:
        super().__init__(highlight=False)
        self._output = output

    def on_broken_pipe(self) -> None:
        self.quiet = True
        self._output.fail(BrokenPipeError())


class TableView(View):
    """A table with one line per joint, redrawn in place; arguments as :class:`View`."""

    def __init__(
        self,
        output: Output,
        joints: Sequence[tuple[str, str]],
        interval: float = 0.125,
        angles: AngleUnit = RADIANS,
        caption: Caption | None = None,
    ) -> None:
        super().__init__(output, joints, interval, angles, caption)
        self._console = _Console(output)
        self._live = Live(console=self._console, auto_refresh=False, redirect_stderr=False)
        self._live.start()

    def note(self, text: str) -> None:
        """Print a message above the table."""
        if self._output.problem is None:
            try:
                # Not wrapped: the terminal does that, and the text can then be pasted whole.
                self._console.print(_note(printable(text)), soft_wrap=True)
            except OSError as error:
                self._output.fail(error)

    def close(self) -> None:
        """Show the last state and release the terminal."""
        super().close()
        try:
            self._live.stop()
        except OSError as error:
            self._output.fail(error)

    def _draw(self, record: CycleRecord) -> None:
        if self._output.problem is not None:
            return
        try:
            lines = self._caption(record) if self._caption is not None else ()
            shown = Group(self._table(record), *(Text(line, overflow="crop") for line in lines))
            self._live.update(shown, refresh=True)
        except OSError as error:
            self._output.fail(error)

    def _table(self, record: CycleRecord) -> Table:
        table = Table(
            title=progress(record, [name for name, _ in self._joints]), title_justify="left"
        )
        table.add_column("joint")
        table.add_column("state", min_width=9)
        # 59 characters in all.
        for column, width in (("position", 11), ("velocity", 13), ("load", 5)):
            table.add_column(column, justify="right", min_width=width)
        for (name, unit), joint in zip(self._joints, record.joints, strict=True):
            state, *values = cells(joint, record.phase, unit, self._angles)
            table.add_row(name, Text(state, _COLOURS.get(state, "")), *values)
        return table


def _note(text: str) -> Text:
    """Return a note; its first word is coloured where it warns."""
    word = text.partition(" ")[0]
    shown = Text(text)
    shown.stylize(_NOTES.get(word, ""), 0, len(word))
    return shown
