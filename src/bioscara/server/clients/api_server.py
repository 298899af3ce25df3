"""The socket on which an owner listens."""

from __future__ import annotations

import asyncio
import grp
import logging
import os
import pwd
import secrets
from concurrent.futures import ThreadPoolExecutor

from bioscara.api import framing, messages as m
from bioscara.api.failures import failure_of
from bioscara.api.runtime import OwnerClaim
from bioscara.errors import AccessError, BioscaraError, BusyOwnerError, ConfigurationError
from bioscara.server.clients.arm_service import ArmService
from bioscara.server.clients.connection import AnySample, Connection, Sessions, Workers
from bioscara.server.clients.peer import Peer

CLIENTS = 200
"""Largest number of connections."""
_WORKERS = 2
"""Threads for commands that take longer, as planning; likewise for queries."""
_TICK = 0.5
"""Period of the check of the socket and the lease [s]."""

_log = logging.getLogger(__name__)


class ApiServer:
    """Accepts the clients of an owner, in the running event loop.

    Args:
        owner: Carries out the requests.
        claim: The claim to the arm's name.
        group: Name of the group whose members may be clients; empty for this user alone.

    Raises:
        ConfigurationError: There is no such group.
    """

    def __init__(self, owner: ArmService, claim: OwnerClaim, group: str = "") -> None:
        self._owner, self._claim = owner, claim
        self._group = _group_number(group)
        self._sessions, self._instance = Sessions(), secrets.token_hex(16)
        self._workers = Workers(
            ThreadPoolExecutor(_WORKERS, "bioscara-command"),
            ThreadPoolExecutor(_WORKERS, "bioscara-query"),
        )
        self._connections: set[Connection] = set()
        self._server: asyncio.Server | None = None
        self._ticking: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Begin to listen.

        Raises:
            OSError: The socket cannot be made.
        """
        self._owner.changed = self._changed
        await self._listen()
        self._ticking = asyncio.get_running_loop().create_task(self._tick())

    async def close(self) -> None:
        """End all connections."""
        if self._ticking is not None:
            self._ticking.cancel()
        if self._server is not None:
            self._server.close()
        for connection in list(self._connections):
            connection.hang_up()
        self._sessions.close()
        for workers in self._workers:
            workers.shutdown(wait=False, cancel_futures=True)

    async def _listen(self) -> None:
        if self._group is not None:
            self._claim.share(self._group)
        self._server = await asyncio.get_running_loop().create_unix_server(
            self._connection, sock=self._claim.listener, backlog=128
        )

    def _connection(self) -> asyncio.Protocol:
        return _Admission(self)

    def admit(self, transport: asyncio.Transport) -> Connection:
        """Return the connection of a client.

        Raises:
            AccessError: Its user may not be a client.
            BusyOwnerError: There are too many clients.
        """
        peer = Peer(transport.get_extra_info("socket"))
        try:
            if not self._may(peer.uid, peer.gid):
                raise AccessError(
                    f"user {peer.uid}, process {peer.pid}, may not use arm {self._owner.name}"
                )
            if len(self._connections) >= CLIENTS:
                raise BusyOwnerError(
                    f"process {peer.pid} is refused: arm {self._owner.name} has {CLIENTS} clients "
                    "already"
                )
        except BioscaraError:
            peer.close()
            raise
        return Connection(
            self._owner, self._sessions, self._instance, self._workers, self._connections, peer
        )

    def _may(self, uid: int, gid: int) -> bool:
        if uid in {0, os.getuid()}:
            return True
        if self._group is None:
            return False
        try:
            name = pwd.getpwuid(uid).pw_name
        except KeyError:
            return gid == self._group
        return self._group in os.getgrouplist(name, gid)

    def _changed(self, has_sample: bool) -> None:
        """Send the new sample, or else the new events."""
        owner, connections = self._owner, tuple(self._connections)
        if not has_sample:
            for connection in connections:
                connection.pump()
            return
        samples: list[tuple[type[AnySample], AnySample | None]] = [
            (m.StateSample, owner.sample),
            (m.ControllersSample, owner.controllers_sample),
        ]
        for kind, sample in samples:
            framed = framing.Framed(sample)
            for connection in connections:
                if sample is not None and connection.wants(kind):
                    connection.offer(kind, framed, sample.time, sample.cycle)
        owner.controllers_wanted = any(each.wants(m.ControllersSample) for each in connections)

    async def _tick(self) -> None:
        """Let a lease lapse in time, and listen again if the socket was removed."""
        while True:
            await asyncio.sleep(_TICK)
            self._owner.tick()
            try:
                former = self._server
                if not self._claim.restore():
                    continue
                if former is not None:
                    former.close()
                await self._listen()
                self._owner.announce(
                    "owner", f"{self._claim.socket} was removed, and made again", ""
                )
            except Exception as error:  # noqa: BLE001  tried again; the arm goes on
                _log.error("%s cannot be made again: %s", self._claim.socket, error)


class _Admission(asyncio.Protocol):
    """A connection whose peer is not known yet."""

    def __init__(self, server: ApiServer) -> None:
        self._server = server

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Admit the peer, or end the connection."""
        assert isinstance(transport, asyncio.Transport)  # noqa: S101  of a stream server
        try:
            connection = self._server.admit(transport)
        except BioscaraError as error:
            _log.warning("%s", error)
            # Its last messages may not be read yet: a refusal is in the usual form of messages.
            transport.write(framing.packed(m.RequestFailed(None, failure_of(error))))
            transport.close()
            return
        transport.set_protocol(connection)
        connection.connection_made(transport)


def _group_number(name: str) -> int | None:
    if not name:
        return None
    try:
        return grp.getgrnam(name).gr_gid
    except KeyError:
        raise ConfigurationError(f"there is no group {name!r}; groupadd makes one") from None
