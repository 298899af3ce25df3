"""The live table, drawn with rich."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.live import Live
from rich.table import Table

from bioscara.cli.output.console import Output
from bioscara.cli.output.live_view import View, cells, progress
from bioscara.printing import printable
from bioscara.report import CycleRecord


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
        self, output: Output, joints: Sequence[tuple[str, str]], interval: float = 0.125
    ) -> None:
        super().__init__(output, joints, interval)
        self._console = _Console(output)
        self._live = Live(console=self._console, auto_refresh=False, redirect_stderr=False)
        self._live.start()

    def note(self, text: str) -> None:
        """Print a message above the table."""
        if self._output.problem is None:
            try:
                self._console.print(printable(text), markup=False)
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
            self._live.update(self._table(record), refresh=True)
        except OSError as error:
            self._output.fail(error)

    def _table(self, record: CycleRecord) -> Table:
        table = Table(title=progress(record), title_justify="left")
        table.add_column("joint")
        table.add_column("state", min_width=9)
        for column in ("position", "velocity", "load"):
            table.add_column(column, justify="right", min_width=13)
        for (name, unit), joint in zip(self._joints, record.joints, strict=True):
            table.add_row(name, *cells(joint, record.phase, unit))
        return table
