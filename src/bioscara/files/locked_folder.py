"""Temporary folders that the next program removes if their own was killed."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path


class LockedFolder:
    """A temporary folder that this process holds locked for as long as it is in use.

    The kernel releases the lock however the process ends. The folders of killed programs are
    removed when the next folder is made.

    Args:
        prefix: Begin of its name; folders of killed programs are found by it.

    Attributes:
        path: The folder.

    Raises:
        OSError: It cannot be made.
    """

    def __init__(self, prefix: str) -> None:
        _remove_left(prefix)
        self.path, self._lock = _locked(prefix)
        self._process = os.getpid()

    def remove(self) -> None:
        """Remove the folder with all that is in it; to be called once.

        In a forked child, whose parent has the folder, nothing happens.
        """
        if os.getpid() == self._process:
            shutil.rmtree(self.path, ignore_errors=True)
            os.close(self._lock)

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.remove()


def _locked(prefix: str) -> tuple[Path, int]:
    """Return a new folder and the descriptor that holds its lock."""
    while True:
        path = Path(tempfile.mkdtemp(prefix=prefix))
        # Before it is locked, another program may take it for one that was left, and remove it.
        with suppress(FileNotFoundError):
            lock = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
            # Where folders cannot be locked, none is taken for one that was left.
            with suppress(OSError):
                fcntl.flock(lock, fcntl.LOCK_EX)
            if _is_at(path, lock):
                return path, lock
            os.close(lock)


def _is_at(path: Path, folder: int) -> bool:
    with suppress(FileNotFoundError):
        return os.path.samestat(path.stat(), os.fstat(folder))
    return False


def _remove_left(prefix: str) -> None:
    """Remove the folders of this user that no process holds."""
    with os.scandir(tempfile.gettempdir()) as entries:
        found = [entry.path for entry in entries if entry.name.startswith(prefix)]
    for path in found:
        with suppress(OSError):
            folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                if os.fstat(folder).st_uid == os.getuid():
                    fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(path)
            finally:
                os.close(folder)
