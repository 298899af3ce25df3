"""The process at the other end of a local socket."""

from __future__ import annotations

import asyncio
import os
import select
import socket
import struct
from collections.abc import Callable

_PEER_PIDFD = 77
"""``SO_PEERPIDFD`` of Linux 6.5 and later, which Python does not name."""
_PEER_GROUPS = 59
"""``SO_PEERGROUPS``, which Python does not name."""
_GROUPS_SIZE = 1024
"""Size of the groups of a process, of four bytes each; Python takes no more [byte]."""
_CREDENTIALS = struct.Struct("3i")


def credentials(connection: socket.socket) -> tuple[int, int, int]:
    """Return process, user and group of the other end."""
    found = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    pid, user, group = _CREDENTIALS.unpack(found)
    return pid, user, group


def may_use(connection: socket.socket, group: int | None) -> bool:
    """Return whether the process at the other end may be a client of an arm of this user.

    The groups are those that the kernel knows of it: to ask for the members of a group may take as
    long as an answer of the network.

    Args:
        connection: The connection.
        group: Number of the group whose members may, too; None for none.
    """
    _, user, own = credentials(connection)
    if user in {0, os.getuid()} or group == own:
        return True
    if group is None:
        return False
    try:
        data = connection.getsockopt(socket.SOL_SOCKET, _PEER_GROUPS, _GROUPS_SIZE)
    except OSError:
        return False
    return group in struct.unpack(f"{len(data) // 4}I", data)


class Peer:
    """The process that has made a connection, also after its end.

    A process that was killed and not awaited by its parent yet still has a number, and a number may
    be given to another process: a descriptor of the process (``pidfd_open(2)``) says surely whether
    it has ended.

    Attributes:
        pid: Number of the process; 0 if it cannot be seen from here, as in another container.
        uid: Its user.
    """

    def __init__(self, connection: socket.socket) -> None:
        self.pid, self.uid, _ = credentials(connection)
        self._ended = False
        self._watched: asyncio.AbstractEventLoop | None = None
        try:
            self._descriptor = _opened(connection, self.pid)
        except ProcessLookupError:
            self._ended, self._descriptor = True, None

    def watch(self, ended: Callable[[], object]) -> None:
        """Call a function when the process ends, in the running event loop."""
        if self._descriptor is not None:
            self._watched = asyncio.get_running_loop()
            self._watched.add_reader(self._descriptor, self._tell, ended)

    def _tell(self, ended: Callable[[], object]) -> None:
        if self.ended:
            ended()

    @property
    def ended(self) -> bool:
        """Whether the process has ended, as far as that is known."""
        if self._descriptor is not None:
            polled = select.poll()
            polled.register(self._descriptor, select.POLLIN)
            if polled.poll(0):
                self._ended = True
                self.close()
        return self._ended

    def close(self) -> None:
        """Forget the process; may be called again."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            if self._watched is not None:
                self._watched.remove_reader(descriptor)
            os.close(descriptor)


def _opened(connection: socket.socket, pid: int) -> int | None:
    """Return a descriptor of the process at the other end; None if it cannot be seen.

    Raises:
        ProcessLookupError: It has ended.
    """
    try:
        data = connection.getsockopt(socket.SOL_SOCKET, _PEER_PIDFD, struct.calcsize("i"))
        return int(struct.unpack("i", data)[0])
    except OSError:
        pass
    try:
        return os.pidfd_open(pid)
    except ProcessLookupError:
        raise
    except OSError:
        # Its lease lapses as that of a silent one.
        return None
