"""Odd entries of the folder of the sockets, and the functions that open its files.

As a program it tries each entry in the place of each file of an arm, and says how that ends:
``odd_entries.py FOLDER``.
"""

from __future__ import annotations

import os
import socket
import stat
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from bioscara.api import runtime
from bioscara.api.gateway_pages import Announcement, page_of
from bioscara.api.runtime import OwnerClaim, find, lock_file, owners
from bioscara.errors import BioscaraError, OwnerLostError
from bioscara.web.access.certificates import self_signed
from bioscara.web.access.tokens import load_tokens

OTHER_USER = 12345
VALID = b'{"pid": 1, "bus": "sim"}'


def locked(content: bytes, size: int = 0, mode: int = 0o600, user: int = -1) -> Callable[..., None]:
    """Return the function that makes a file which this process has locked."""

    def make(path: Path) -> None:
        lock = lock_file(path, {})
        assert lock is not None
        os.pwrite(lock, content, 0)
        os.truncate(path, max(size, len(content)))
        path.chmod(mode)
        os.chown(path, user, -1)

    return make


def bound(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(os.fspath(path))


def device(path: Path) -> None:
    # A container may forbid it.
    with suppress(PermissionError):
        os.mknod(path, stat.S_IFCHR | 0o600, os.makedev(1, 5))


KINDS: dict[str, Callable[[Path], object]] = {
    "pipe": os.mkfifo,
    "folder": Path.mkdir,
    "loop": lambda path: path.symlink_to(path),
    "link": lambda path: path.symlink_to("left.lock"),
    "socket": bound,
    "unreadable": locked(b"x", mode=0),
    "huge": locked(b"[", size=1 << 40),
    "words": locked(b"words"),
    "bytes": locked(bytes(range(256))),
    "deep": locked(b"[" * 4096),
    "list": locked(b"[1]"),
    "digits": locked(b'{"pid": ' + b"9" * 4000 + b', "bus": "sim"}'),
    "none": locked(b'{"pid": -1, "bus": "sim"}'),
    **({"device": device, "other": locked(VALID, user=OTHER_USER)} if os.getuid() == 0 else {}),
}
"""Entries that are no files of an owner."""


def claimed(_: Path) -> None:
    OwnerClaim("left", "sim").close()


def certified(path: Path) -> None:
    """Make or use a certificate and its key, of which the other one can be used."""
    other, pair = path.with_suffix({".crt": ".key", ".key": ".crt"}[path.suffix]), path.parent / "a"
    self_signed(pair.with_suffix(".crt"), pair.with_suffix(".key"), ["localhost"])
    pair.with_suffix(other.suffix).rename(other)
    self_signed(path.with_suffix(".crt"), path.with_suffix(".key"), ["localhost"])


PLACES: dict[str, Callable[[Path], object]] = {
    "left.lock": claimed,
    "left.sock": claimed,
    "left.tokens": load_tokens,
    "left.crt": certified,
    "left.key": certified,
    "left.1.page": lambda _: Announcement("left", 1, "http://127.0.0.1:1/").close(),
}
"""Files of an arm, each with the function that makes or uses it."""


def main(folder: Path) -> None:
    for place, use in PLACES.items():
        for kind, make in KINDS.items():
            inner = folder / f"{place[5:]}-{kind}"
            inner.mkdir(mode=0o700)
            os.environ[runtime.VARIABLE] = str(inner)
            sys.stdout.write(f"{place} is a {kind}: ")
            sys.stdout.flush()
            make(inner / place)
            assert owners() == []
            assert page_of("left") is None
            with suppress(OwnerLostError):
                raise AssertionError(find("left"))
            try:
                use(inner / place)
            except BioscaraError as error:
                sys.stdout.write(f"{error}\n")
            else:
                sys.stdout.write("used\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
