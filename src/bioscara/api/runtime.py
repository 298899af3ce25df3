"""Sockets of running owners, by the names of their arms.

Each owner holds a lock on a file next to its socket for as long as it lives. Whether an owner runs
is decided by that lock alone: the kernel releases it when the process ends, however it ends.
Imports the standard library and modules that do so only, as ``bioscara stop`` must be fast.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import re
import socket
import stat
import struct
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from bioscara.errors import (
    AccessError,
    BusyOwnerError,
    ConfigurationError,
    InvalidArgumentError,
    OwnerLostError,
)
from bioscara.files.regular_file import RegularFile
from bioscara.printing import brief
from bioscara.processes.forking import in_child

VARIABLE = "BIOSCARA_RUNTIME"
"""Environment variable that names another folder for the sockets."""
SERVICES = Path("/run/bioscara")
"""Folder of the sockets of the system's services, which root has made."""
STOP_SUFFIX = ".stop"
"""End of the path of the socket for STOP, in place of ``.sock``."""
DEFAULT = "arm"
"""Name of an owner unless another one is given."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,63}")
_FLOCK = "hhqqi"
"""Layout of Linux's ``struct flock`` with 64-bit offsets."""
_WRITE_LOCK = struct.pack(_FLOCK, fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
"""A lock of the whole file, of this opening of it: a closed copy of it does not end the lock."""
_CREDENTIALS = struct.Struct("3i")
"""Process, user and group of the other end, as a ``struct ucred``."""
_BACKLOG = 128
"""Clients that may wait to be served."""
_LONGEST_CONTENT = 4096
"""Longest content of a lock file [byte]."""
_LONGEST_PATH = 107
"""Longest path of a Unix socket on Linux [byte]."""


class OwnerEntry(NamedTuple):
    """A running owner.

    Attributes:
        name: Name of its arm.
        bus: Name of its bus.
        pid: Its process.
        socket: Its socket.
    """

    name: str
    bus: str
    pid: int
    socket: Path

    @property
    def stop_socket(self) -> Path:
        """Its socket for STOP alone, which the process that moves the arm reads itself."""
        return self.socket.with_suffix(STOP_SUFFIX)


def folder() -> Path:
    """Return the folder of the sockets: of this user, or of the system's services.

    Raises:
        AccessError: It belongs to another user.
    """
    if given := os.environ.get(VARIABLE):
        return Path(given)
    if runtime := os.environ.get("XDG_RUNTIME_DIR"):
        return Path(runtime) / "bioscara"
    if os.getuid() == 0:
        return SERVICES
    path = Path(f"/tmp/bioscara-{os.getuid()}")  # noqa: S108  its owner is checked
    with suppress(FileNotFoundError):
        # Anyone may make it there, and would be taken for the owner of the arm.
        if path.lstat().st_uid != os.getuid():
            raise AccessError(f"{path} belongs to another user; set {VARIABLE} to an own folder")
    return path


def folders() -> tuple[Path, ...]:
    """Return the folders in which owners are looked for: that of this user, and the services'.

    Raises:
        AccessError: The first one belongs to another user.
    """
    own = folder()
    return (own,) if own == SERVICES or os.environ.get(VARIABLE) else (own, SERVICES)


def unlisted() -> str:
    """Return in words that there may be arms that this user cannot find; empty if there are none.

    Raises:
        AccessError: The folder of this user belongs to another one.
    """
    if SERVICES not in folders()[1:] or not SERVICES.is_dir() or os.access(SERVICES, os.R_OK):
        return ""
    return f"; those of {SERVICES} are for members of the group bioscara, after their next login"


def is_name(name: str) -> bool:
    """Return whether a text can be the name of an arm."""
    return _NAME.fullmatch(name) is not None


def require_name(name: str) -> str:
    """Return the name of an arm.

    Raises:
        InvalidArgumentError: It is none.
    """
    if not isinstance(name, str) or not is_name(name):
        raise InvalidArgumentError(
            f"{name!r} is no name of an arm: it begins with a letter and has up to 64 letters, "
            "digits, '_' or '-'"
        )
    return name


def socket_of(name: str) -> Path:
    """Return the path of an owner's socket.

    Raises:
        InvalidArgumentError: The name or the path cannot be used.
    """
    path = folder() / f"{require_name(name)}.sock"
    if len(os.fsencode(path)) > _LONGEST_PATH:
        raise InvalidArgumentError(
            f"{path}: a socket's path has at most {_LONGEST_PATH} bytes; set {VARIABLE} to a "
            "shorter folder"
        )
    return path


def owners() -> list[OwnerEntry]:
    """Return the running owners, by name; of those of services, the ones that this user may use.

    Raises:
        AccessError: The folder belongs to another user, or this one may not list it.
    """
    own, *services = folders()
    try:
        entries = _entries(own)
    except PermissionError as error:
        raise AccessError(
            f"{own} cannot be listed, so it is unknown which arms are served: {error.strerror}; "
            f"join the group of their owner, or set {VARIABLE} to another folder"
        ) from error
    for path in services:
        with suppress(PermissionError):
            entries += _entries(path)
    return sorted(entries)


def find(name: str) -> OwnerEntry:
    """Return the running owner of an arm: that of this user, else that of a service.

    Raises:
        InvalidArgumentError: The name cannot be used.
        OwnerLostError: No owner of that name runs, or this user may not find it.
    """
    lock = socket_of(name).with_suffix(".lock")
    for path in folders():
        if entry := _entry(path / lock.name):
            return entry
    try:
        running = [each.name for each in owners()]
    except AccessError as error:
        raise OwnerLostError(f"no owner of arm {name} was found: {error}") from error
    hint = f"there are {', '.join(running)}" if running else "bioscara serve starts one"
    raise OwnerLostError(f"no owner of arm {name} runs; {hint}{unlisted()}")


def has_ended(owner: OwnerEntry) -> bool:
    """Return whether an owner that was found has ended, and there is no other one of its name.

    Where its files were removed this is unknown, and the answer is false.
    """
    lock = owner.socket.with_suffix(".lock")
    return lock.exists() and locked_content(lock) is None


class OwnerClaim:
    """The right to be the owner of an arm, until :meth:`close`.

    Args:
        name: Name of the arm.
        bus: Name of its bus, for others to see.
        shared: Whether it is for a group, which may then also write in its folder.

    Attributes:
        socket: Path of its socket.
        listener: The socket, listening: clients that connect before they are served wait.
        stops: The socket for STOP alone, which takes packets, listening.

    Raises:
        InvalidArgumentError: The name cannot be used.
        AccessError: The folder belongs to another user, is a link, or others could put another one
            in its place.
        BusyOwnerError: An owner of that name runs.
        ConfigurationError: The folder cannot be made or written.
    """

    def __init__(self, name: str, bus: str, *, shared: bool = False) -> None:
        self._name, self._bus, self._shared = name, bus, shared
        self.socket = socket_of(name)
        self._stop_socket = self.socket.with_suffix(STOP_SUFFIX)
        self._path = self.socket.with_suffix(".lock")
        try:
            self._lock = self._take()
            self._listen()
        except OSError as error:
            odd = error.filename in {str(self.socket), str(self._path)}
            what, remedy = (f"{Path(error.filename).name}: ", "remove it, or ") if odd else ("", "")
            raise ConfigurationError(
                f"the sockets of served arms cannot be in {self.socket.parent}: "
                f"{what}{error.strerror or error}; {remedy}set {VARIABLE} to another folder"
            ) from error
        in_child(self._forget)

    def _forget(self) -> None:
        # A copy of the lock in a child would outlive the owner.
        self._close_sockets()
        os.close(self._lock)
        self._lock = -1

    def restore(self) -> bool:
        """Make the files again if they were removed; return whether they were.

        Raises:
            AccessError, BusyOwnerError, OSError: As at the beginning.
        """
        with suppress(OSError):
            if (
                self.socket.is_socket()
                and self._stop_socket.is_socket()
                and self._path.stat().st_ino == os.fstat(self._lock).st_ino
            ):
                return False
        if self._removed():
            lock, self._lock = self._lock, self._take()
            os.close(lock)
        former = self.listener, self.stops
        self._listen()
        for each in former:
            each.close()
        return True

    def share(self, group: int) -> None:
        """Let the members of a group find the owner and connect to it.

        Args:
            group: Number of the group.

        Raises:
            AccessError: This process may not do that.
            OSError: The files are gone.
        """
        # The folder can be listed: `bioscara stop` finds the arms of all owners there.
        modes = (
            (self.socket.parent, 0o750),
            (self._path, 0o640),
            (self.socket, 0o660),
            (self._stop_socket, 0o660),
        )
        for path, mode in modes:
            try:
                os.chown(path, -1, group)
            except PermissionError as error:
                raise AccessError(
                    f"{path} cannot be given to the group with number {group}: "
                    f"{error.strerror}; its owner has to be a member of the group since login, "
                    "see id -Gn"
                ) from error
            path.chmod(mode)

    def close(self) -> None:
        """Give the name free; may be called again."""
        if self._lock < 0:
            return
        self._close_sockets()
        with suppress(OSError):
            # The files may have been removed, and be those of another owner now.
            if not self._removed():
                self.socket.unlink(missing_ok=True)
                self._stop_socket.unlink(missing_ok=True)
            os.ftruncate(self._lock, 0)
        os.close(self._lock)
        self._lock = -1

    def _close_sockets(self) -> None:
        self.listener.close()
        self.stops.close()

    def _listen(self) -> None:
        self.listener = _listening(self.socket, socket.SOCK_STREAM)
        self.stops = _listening(self._stop_socket, socket.SOCK_SEQPACKET)
        self.stops.setblocking(False)

    def _removed(self) -> bool:
        try:
            return self._path.stat().st_ino != os.fstat(self._lock).st_ino
        except OSError:
            return True

    def _take(self) -> int:
        for path in folders()[1:]:
            if entry := _entry(path / self._path.name):
                raise _taken(entry.name, f"process {entry.pid} on {entry.bus}, a service")
        _make_folder(self._path.parent, shared=self._shared)
        lock = lock_file(self._path, {"pid": os.getpid(), "bus": self._bus})
        if lock is None:
            entry = _entry(self._path)
            other = f"process {entry.pid} on {entry.bus}" if entry else "another process"
            raise _taken(self._name, other)
        return lock


def _listening(path: Path, kind: int) -> socket.socket:
    """Return a socket that listens at a path, to which only this user may connect."""
    path.unlink(missing_ok=True)
    listener = socket.socket(socket.AF_UNIX, kind | socket.SOCK_CLOEXEC)
    before = os.umask(0o177)
    try:
        listener.bind(os.fspath(path))
    except OSError:
        listener.close()
        raise
    finally:
        os.umask(before)
    listener.listen(_BACKLOG)
    return listener


def lock_file(path: Path, content: dict[str, object]) -> int | None:
    """Make or take a file that says something for as long as this process has it open.

    Returns:
        The opened file; None if another process has it.

    Raises:
        OSError: It cannot be written, or is no regular file of this user.
    """
    # Not blocking: else a pipe or a device without another end would be waited for.
    flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
    lock = os.open(path, flags, 0o600)
    status = os.fstat(lock)
    if not stat.S_ISREG(status.st_mode) or status.st_uid != os.getuid():
        os.close(lock)
        raise OSError(errno.EINVAL, "it is no regular file of this user", str(path))
    try:
        fcntl.fcntl(lock, fcntl.F_OFD_SETLK, _WRITE_LOCK)
    except (BlockingIOError, PermissionError):
        os.close(lock)
        return None
    os.ftruncate(lock, 0)
    os.pwrite(lock, json.dumps(content).encode(), 0)
    return lock


def locked_content(path: Path) -> dict[str, object] | None:
    """Return the content of a file of :func:`lock_file`; None if no process has locked it.

    None also for what such a file cannot be: others may put anything into a folder that they share.
    """
    try:
        with RegularFile(path).open() as file:
            if os.fstat(file.fileno()).st_uid not in _trusted(path.parent):
                return None
            # Asked for, not taken: a lock taken for a moment would refuse an owner that begins.
            found = fcntl.fcntl(file, fcntl.F_OFD_GETLK, _WRITE_LOCK)
            if struct.unpack(_FLOCK, found)[0] == fcntl.F_UNLCK:
                return None
            content = json.loads(os.pread(file.fileno(), _LONGEST_CONTENT, 0))
    except (OSError, ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) else None


def _taken(name: str, other: str) -> BusyOwnerError:
    return BusyOwnerError(f"arm {name} has an owner, {other}; give another --name, or end that one")


def _entries(path: Path) -> list[OwnerEntry]:
    """Return the owners of a folder.

    Raises:
        PermissionError: This user may not list it.
    """
    try:
        # Not by glob, to which a folder that may not be listed is an empty one.
        locks = [path / name for name in os.listdir(path) if name.endswith(".lock")]
    except PermissionError:
        raise
    except OSError:
        return []
    entries = [_entry(lock) for lock in locks if is_name(lock.stem)]
    return [entry for entry in entries if entry is not None]


def require_trusted(connection: socket.socket, path: Path) -> int:
    """Check the process that listens at the socket of an owner, before anything is sent; return it.

    The process that listens has to be one of root, of this user, or of the user to whom the folder
    of the socket belongs: others, such as a member of a group that may write there, could have put
    a socket in the place of the owner's.

    Args:
        connection: Connected to it.
        path: Its path.

    Raises:
        AccessError: It is another user's.
        OSError: The folder is gone.
    """
    # The kernel keeps this of the process that listens, also where the file was replaced since.
    found = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    pid, user, _ = _CREDENTIALS.unpack(found)
    if user not in _trusted(path.parent):
        raise AccessError(
            f"process {pid} of user {user} listens at {path}, and the folder is not that user's: "
            "nothing was sent to it; end that process, and see who may write in the folder"
        )
    return int(pid)


def _trusted(folder: Path) -> set[int]:
    """Return the users whose sockets and files in a folder are used.

    Raises:
        OSError: The folder is gone.
    """
    return {0, os.getuid(), folder.stat().st_uid}


def _make_folder(path: Path, *, shared: bool) -> None:
    path.mkdir(mode=0o700, parents=True, exist_ok=True)
    status = path.lstat()
    if stat.S_ISLNK(status.st_mode):
        raise AccessError(f"{path} is a link; set {VARIABLE} to the folder itself")
    if status.st_uid != os.getuid():
        raise AccessError(
            f"{path} belongs to user {status.st_uid}; set {VARIABLE} to an own folder"
        )
    if _replaceable(status, stat.S_IWOTH):
        raise AccessError(f"{path} can be written by every user; chmod o-w {path}")
    if not shared and _replaceable(status, stat.S_IWGRP):
        raise AccessError(
            f"{path} can be written by the group with number {status.st_gid}, whose members could "
            f"take the owner's place; chmod g-w {path}"
        )
    for parent in path.absolute().parents:
        if _replaceable(parent.stat(), stat.S_IWOTH):
            raise AccessError(
                f"{parent}, which {path} is in, can be written by every user; chmod o-w {parent}, "
                f"or set {VARIABLE} to another folder"
            )


def _replaceable(status: os.stat_result, writers: int) -> bool:
    """Return whether some may rename and remove what others have in a folder."""
    return bool(status.st_mode & writers) and not status.st_mode & stat.S_ISVTX


def _entry(lock: Path) -> OwnerEntry | None:
    """Return the owner that holds a lock; None if none does."""
    content = locked_content(lock)
    if content is not None:
        with suppress(ValueError, KeyError, TypeError, OverflowError):
            bus, pid = brief(str(content["bus"])), int(str(content["pid"]))
            if 0 < pid < 1 << 31:
                return OwnerEntry(lock.stem, bus, pid, lock.with_suffix(".sock"))
    return None
