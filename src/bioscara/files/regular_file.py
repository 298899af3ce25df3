"""Regular files, opened without following a link that took the place of one."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import Any, BinaryIO

MCAP_BEGIN = b"\x89MCAP0\r\n"
"""The first bytes of each MCAP file."""


class RegularFile(type(Path())):  # type: ignore[misc]  # the class of this system's paths
    """The path of a file that is read only if it is a regular one.

    A folder that others can write to, or that was unpacked, may have a link to a file with
    secrets under a name of its own, or a pipe, of which reading never ends.
    """

    __slots__ = ()

    def open(self, *_: Any, **__: Any) -> BinaryIO:
        """Open it for reading as bytes.

        Raises:
            OSError: It cannot be opened, or is none.
        """
        # Not blocking: else a pipe without a writer would be waited for.
        file = os.open(self, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
        if not stat.S_ISREG(os.fstat(file).st_mode):
            os.close(file)
            raise OSError(errno.EINVAL, "it is no regular file", str(self))
        return os.fdopen(file, "rb")

    def stat(self, *, follow_symlinks: bool = False) -> os.stat_result:  # noqa: ARG002
        """Return the status of the file, or of the link that is there."""
        return os.lstat(self)


class McapFile(RegularFile):
    """The path of a regular file that is read only if it begins as an MCAP file does.

    Under such a name there may be a hard link to a file with secrets, which is a regular one.
    """

    __slots__ = ()

    def open(self, *_: Any, **__: Any) -> BinaryIO:
        """Open it for reading as bytes.

        Raises:
            OSError: It cannot be opened, or is none.
        """
        file = super().open()
        if file.read(len(MCAP_BEGIN)) != MCAP_BEGIN:
            file.close()
            raise OSError(errno.EINVAL, "it is no MCAP file", str(self))
        file.seek(0)
        return file

    def is_one(self) -> bool:
        """Return whether it can be opened."""
        try:
            self.open().close()
        except OSError:
            return False
        return True


def mcap_files(folder: Path) -> list[McapFile]:
    """Return the regular files of a folder with the name of an MCAP file, also with other content.

    They are in no order; there are none if the folder does not exist.
    """
    try:
        with os.scandir(folder) as entries:
            names = [each.name for each in entries if each.is_file(follow_symlinks=False)]
    except FileNotFoundError:
        return []
    return [McapFile(folder, name) for name in names if name.endswith(".mcap")]
