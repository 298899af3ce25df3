"""Files that are written whole or not at all."""

from __future__ import annotations

import errno
import os
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
