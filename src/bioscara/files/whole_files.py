"""Files that are written whole or not at all, and new ones that end with a whole record."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Replace a file by the one that the block writes.

    If the block or the replacement fails, as on a full disk, the file keeps its former content or
    does not exist. A device or pipe is written directly.

    Args:
        path: The file; if it is a link, its target is replaced, with the same permissions.

    Yields:
        Path for the block to write to, in the folder of the file.

    Raises:
        OSError: The file cannot be written.
    """
    goal = Path(os.path.realpath(path))
    if goal.is_symlink():  # only a loop of links resolves to a link
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
    if goal.exists() and not goal.is_file():
        yield goal
        return
    partial = goal.with_name(f".{goal.name}.{os.urandom(8).hex()}.new")
    try:
        yield partial
        with partial.open("rb") as file:
            os.fsync(file.fileno())
        if goal.exists():
            partial.chmod(goal.stat().st_mode & 0o777)
        partial.replace(goal)
    finally:
        partial.unlink(missing_ok=True)
    folder = os.open(goal.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Make a folder with all files that the block writes, or none.

    Args:
        path: The folder; it must be empty or not exist.

    Yields:
        Folder for the block to write to, beside it.

    Raises:
        OSError: It cannot be made, or is not empty.
    """
    goal = Path(os.path.realpath(path))
    partial = goal.with_name(f".{goal.name}.{os.urandom(8).hex()}.new")
    partial.mkdir(parents=True)
    try:
        yield partial
        partial.rename(goal)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


class AppendedFile:
    """A new file that ends with the last record that was written whole, also after an error.

    Args:
        path: The file; it must not exist.
        mode: Its permissions, before the mask of the process.

    Raises:
        OSError: It cannot be created.
    """

    def __init__(self, path: Path, mode: int = 0o666) -> None:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
        self._file = os.open(path, flags, mode)
        self._size = 0

    def write(self, data: bytes) -> int:
        """Append a record; return its size.

        Raises:
            OSError: It does not fit, and nothing of it stays.
        """
        remaining = memoryview(data)
        try:
            while remaining:
                remaining = remaining[os.write(self._file, remaining) :]
        except OSError:
            os.ftruncate(self._file, self._size)
            raise
        self._size += len(data)
        return len(data)

    def close(self) -> None:
        """Close the file; may be called twice."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
