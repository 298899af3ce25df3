"""The file with the named poses, tools and frames, which keeps them when the owner ends."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from bioscara.errors import ConfigurationError
from bioscara.robot.workspace.poses import TeachTable
from bioscara.robot.workspace.teach_file import changing, load_table, save_table
from bioscara.robot.workspace.tools import Tool
from bioscara.whole_files import replacing


class TableFile:
    """The file of ``bioscara poses``, read when the owner starts and replaced at each change.

    Args:
        path: The file, which need not exist; None if nothing is kept.
        fingers: The tool that the parameters describe.
    """

    def __init__(self, path: Path | None, fingers: Tool) -> None:
        self._path, self._fingers = path, fingers
        self._known = TeachTable(fingers)

    def read(self) -> TeachTable | None:
        """Return the table in the file; None if there is no file.

        Raises:
            ConfigurationError: It cannot be read; names file and line.
        """
        if self._path is None or not self._path.exists():
            return None
        self._known = load_table(self._path, self._fingers)
        return self._known

    def save(self, table: TeachTable) -> TeachTable | None:
        """Replace the file, unless another program has changed it since it was read.

        Entries that the new table has no more are kept in a copy, FILE.bak.

        Args:
            table: The new table.

        Returns:
            The table in the file if another program has changed it: then nothing is written. None
            if the table is saved.

        Raises:
            ConfigurationError: The file cannot be read or written; it keeps its former content.
        """
        path, table = self._path, replace(table, fingers=self._fingers)
        if path is None:
            return None
        with changing(path):
            known, there = self._known, self.read() or TeachTable(self._fingers)
            self._known = there
            if there != known:
                return there
            if _names(there) - _names(table):
                _copy(path)
            save_table(path, table)
        self._known = table
        return None


def _names(table: TeachTable) -> set[tuple[str, str]]:
    return {
        *(("tool", tool.name) for tool in table.tools),
        *(("pose", pose.name) for pose in table.poses),
        *(("frame", frame.name) for frame in table.frames),
    }


def _copy(path: Path) -> None:
    copy = path.with_name(f"{path.name}.bak")
    try:
        with replacing(copy) as partial:
            partial.write_bytes(path.read_bytes())
    except OSError as error:
        raise ConfigurationError(
            f"{copy}: the poses that the change removes cannot be kept "
            f"({error.strerror or error}); nothing was changed"
        ) from error
