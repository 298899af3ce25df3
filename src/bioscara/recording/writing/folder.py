"""The folder of an arm's recordings: names, room on the disk, and which ones are kept."""

from __future__ import annotations

import os
import re
import time
from pathlib import Path

from bioscara.api.runtime import require_name
from bioscara.files.regular_file import McapFile, mcap_files

SUFFIX = ".mcap"
RESERVE = 32 << 20
"""Room on the disk that recordings leave to others, as to the evidence of faults [byte]."""
_STAMP = "%Y%m%dT%H%M%SZ"


class RecordingFolder:
    """The recordings of one arm.

    Args:
        path: The folder; made when the first file is.
        arm: Name of the owner.
        keep: Total size above which the oldest are deleted [byte].

    Attributes:
        path: As given.

    Raises:
        InvalidArgumentError: The name of the owner cannot be used.
    """

    def __init__(self, path: Path, arm: str, keep: int) -> None:
        self.path, self._arm, self._keep = path, require_name(arm), keep
        # The stamp sorts by time; a number follows where two began in the same second.
        self._name = re.compile(rf"{re.escape(arm)}-(\d{{8}}T\d{{6}}Z)(?:-(\d+))?{SUFFIX}")

    def files(self) -> list[McapFile]:
        """Return the recordings, oldest first; a link or a pipe with such a name is none."""
        files = mcap_files(self.path)
        named = [(self._name.fullmatch(path.name), path) for path in files]
        found = [(match[1], int(match[2] or 1), path) for match, path in named if match]
        return [path for *_, path in sorted(found)]

    def new_path(self) -> Path:
        """Return the path of the next file; its folder exists.

        Raises:
            OSError: The folder cannot be made.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        stem = f"{self._arm}-{time.strftime(_STAMP, time.gmtime())}"
        path, number = self.path / f"{stem}{SUFFIX}", 1
        while path.exists():
            number += 1
            path = self.path / f"{stem}-{number}{SUFFIX}"
        return path

    def delete_oldest(self, written: Path | None = None) -> list[Path]:
        """Delete the oldest files until all together keep to the total size.

        Args:
            written: The file that is being written, which stays.

        Returns:
            The deleted files.

        Raises:
            OSError: One cannot be deleted.
        """
        sizes = [(path, path.stat().st_size) for path in self.files()]
        total = sum(size for _, size in sizes)
        deleted: list[Path] = []
        for path, size in sizes:
            if total <= self._keep or path == written:
                break
            path.unlink()
            total -= size
            deleted.append(path)
        return deleted

    def room(self) -> int:
        """Return how much may still be written [byte]; below zero once the reserve is touched.

        Raises:
            OSError: The disk cannot be asked.
        """
        disk = os.statvfs(self.path)
        return disk.f_bavail * disk.f_frsize - RESERVE

    def sync(self) -> None:
        """Wait until the names of its files are on the disk.

        Raises:
            OSError: The disk failed.
        """
        folder = os.open(self.path, os.O_RDONLY | os.O_CLOEXEC)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
