"""Files with the values that clients set, poses and zones, which keep it when the owner ends."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Generic, TypeVar

from bioscara.errors import ConfigurationError
from bioscara.files.whole_files import replacing
from bioscara.planning.collision.scene import Scene
from bioscara.planning.files.scene_file import read_scene, save_scene
from bioscara.robot.workspace.poses import TeachTable
from bioscara.robot.workspace.teach_file import changing, load_table, save_table
from bioscara.robot.workspace.tools import Tool

T = TypeVar("T")


class KeptFile(Generic[T]):
    """A file that is read when the owner starts, and replaced at each change.

    Args:
        path: The file, which need not exist; None if nothing is kept.
        load: Reads it.
        save: Writes it.
        empty: The content that no file stands for; None if a file that is gone is an error.
        loses: Returns whether the second content lacks something of the first one, which is then
            kept in a copy, FILE.bak.
    """

    def __init__(
        self,
        path: Path | None,
        load: Callable[[Path], T],
        save: Callable[[Path, T], None],
        empty: T | None,
        loses: Callable[[T, T], object],
    ) -> None:
        self._path, self._load, self._save, self._empty = path, load, save, empty
        self._loses = loses
        self._known: T | None = empty

    def read(self) -> T | None:
        """Return the content; None if there is no file.

        Raises:
            ConfigurationError: It cannot be read; names file and line.
        """
        if self._path is None or not self._path.exists():
            return None
        self._known = self._load(self._path)
        return self._known

    def save(self, value: T) -> T | None:
        """Replace the file, unless another program has changed it since it was read.

        Returns:
            The content of the file if another program has changed it: then nothing is written. None
            if the new one is saved.

        Raises:
            ConfigurationError: The file cannot be read or written; it keeps its former content.
        """
        path = self._path
        if path is None:
            return None
        with changing(path):
            known, there = self._known, self.read() or self._empty
            if there is None:
                raise ConfigurationError(
                    f"{path} is gone; the arm keeps what it has: restore the file"
                )
            self._known = there
            if there != known:
                return there
            if self._loses(there, value):
                _copy(path)
            self._save(path, value)
            self.read()
        return None


def table_file(path: Path | None, fingers: Tool) -> KeptFile[TeachTable]:
    """Return the file of ``bioscara poses``.

    Args:
        path: The file; None if nothing is kept.
        fingers: The tool that the parameters describe.
    """
    load = partial(load_table, fingers=fingers)
    return KeptFile(
        path, load, save_table, TeachTable(fingers), lambda one, other: _names(one) - _names(other)
    )


def scene_file(path: Path | None) -> KeptFile[Scene]:
    """Return the file of ``--scene``, of which a copy is kept: a person may have written it.

    Args:
        path: The file; None if nothing is kept.
    """
    # A bench without its file is not an empty one.
    return KeptFile(path, read_scene, save_scene, None, lambda one, other: one != other)


def _names(table: TeachTable) -> set[tuple[str, str]]:
    return {
        *(("tool", tool.name) for tool in table.tools),
        *(("pose", pose.name) for pose in table.poses),
        *(("frame", frame.name) for frame in table.frames),
    }


def _copy(path: Path) -> None:
    copy = path.with_name(f"{path.name}.bak")
    try:
        with replacing(copy) as partial_copy:
            partial_copy.write_bytes(path.read_bytes())
    except OSError as error:
        raise ConfigurationError(
            f"{copy}: what the change removes cannot be kept ({error.strerror or error}); nothing "
            "was changed"
        ) from error
