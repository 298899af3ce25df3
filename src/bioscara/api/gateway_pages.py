"""Addresses of the pages of gateways, for lists of the arms of this computer.

A gateway has a file next to its owner's socket, locked for as long as it lives: one that was
killed leaves no address behind.
"""

from __future__ import annotations

import os
import re
import time
from contextlib import suppress

from bioscara.api.runtime import folder, folders, lock_file, locked_content, require_name

_STALE = 60.0
"""Age of a file without a lock from which it is removed [s]."""
_URL = re.compile(r"https?://[A-Za-z0-9.:\[\]_-]{1,260}/")


class Announcement:
    """The address of the page of a gateway, until :meth:`close`.

    If its file cannot be written, the gateway works all the same, and is in no list.

    Args:
        arm: Name of the owner.
        port: TCP port of the gateway, for the name of the file.
        url: The address.
    """

    def __init__(self, arm: str, port: int, url: str) -> None:
        self._path = folder() / f"{require_name(arm)}.{port}.page"
        self._lock: int | None = None
        with suppress(OSError):
            self._lock = lock_file(self._path, {"pid": os.getpid(), "url": url})

    def close(self) -> None:
        """Remove it; may be called again."""
        if self._lock is None:
            return
        with suppress(OSError):
            self._path.unlink()
        os.close(self._lock)
        self._lock = None


def page_of(arm: str) -> str | None:
    """Return the address of the page of an arm's gateway; None if it has none.

    Args:
        arm: Name of the owner.
    """
    pattern = f"{require_name(arm)}.*.page"
    for path in [each for place in folders() for each in sorted(place.glob(pattern))]:
        content = locked_content(path)
        url = None if content is None else content.get("url")
        if isinstance(url, str) and _URL.fullmatch(url):
            return url
        with suppress(OSError):
            if content is None and time.time() - path.lstat().st_mtime > _STALE:
                # Of a gateway that was killed; a younger one may be about to be locked.
                path.unlink()
    return None
