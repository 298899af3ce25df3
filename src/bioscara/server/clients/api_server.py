"""The socket on which an owner listens."""

from __future__ import annotations

import asyncio
import logging
import secrets
import socket

from bioscara.api import framing, messages as m
from bioscara.api.failures import failure_of
from bioscara.errors import AccessError, BioscaraError
from bioscara.server.clients.arm_service import ArmService
from bioscara.server.clients.connection import AnySample, Connection, Sessions
from bioscara.server.clients.crowd import Crowd
from bioscara.server.clients.peer import Peer, may_use

_POLL = 0.01
_log = logging.getLogger(__name__)


class ApiServer:
    """Accepts the clients of an arm, in the running event loop.

    Args:
        service: Carries out the requests.
        group: Number of the group whose members may be clients; None for this user alone.
    """

    def __init__(self, service: ArmService, group: int | None = None) -> None:
        self._service, self._group = service, group
        self._crowd = Crowd(service)
        self._sessions, self._instance = Sessions(service), secrets.token_hex(16)
        self._server: asyncio.Server | None = None
        self._listening: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Send samples and events from now on."""
        self._service.changed = self._changed

    def listen(self, listener: socket.socket) -> asyncio.Task[None]:
        """Accept clients on a socket that listens, in place of the one before."""
        self._listening = asyncio.get_running_loop().create_task(self._listen(listener))
        return self._listening

    async def close(self) -> None:
        """End all connections, once their last messages are sent."""
        if self._server is not None:
            self._server.close()
        for connection in list(self._crowd.connections):
            connection.hang_up()
        while self._crowd.connections:
            await asyncio.sleep(_POLL)
        self._sessions.close()

    def send_record(self, session: str, cycle: m.GoalCycle) -> None:
        """Send a record of a cycle to a client, unless it is not connected."""
        if (connection := self._sessions.newest_connection(session)) is not None:
            connection.offer_record(cycle)

    async def _listen(self, listener: socket.socket) -> None:
        former = self._server
        self._server = await asyncio.get_running_loop().create_unix_server(
            lambda: _Admission(self), sock=listener, backlog=128
        )
        if former is not None:
            former.close()

    def admit(self, transport: asyncio.Transport) -> Connection:
        """Return the connection of a client; one too many may only send STOP.

        Raises:
            AccessError: Its user may not be a client.
        """
        peer = Peer(transport.get_extra_info("socket"))
        if not may_use(transport.get_extra_info("socket"), self._group):
            peer.close()
            raise AccessError(
                f"user {peer.uid}, process {peer.pid}, may not use arm {self._service.name}"
            )
        crowd = self._crowd
        only_stop = crowd.is_full(peer.pid)
        if only_stop:
            crowd.make_room()
        return Connection(
            self._service, self._sessions, self._instance, crowd, peer, only_stop=only_stop
        )

    def _changed(self, has_sample: bool) -> None:
        """Send the new sample, or else the new events."""
        owner, connections = self._service, tuple(self._crowd.connections)
        if not has_sample:
            for connection in connections:
                connection.pump()
            return
        samples: list[tuple[type[AnySample], AnySample | None]] = [
            (m.StateSample, owner.sample),
            (m.ControllersSample, owner.controllers_sample),
            (m.WorldSample, owner.world_sample),
        ]
        for kind, sample in samples:
            framed = framing.Framed(sample)
            for connection in connections:
                if sample is not None and connection.wants(kind):
                    connection.offer(kind, framed, sample.time, sample.cycle)
        owner.want(
            controllers=any(each.wants(m.ControllersSample) for each in connections),
            world=any(each.wants(m.WorldSample) for each in connections),
        )


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
