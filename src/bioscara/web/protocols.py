"""HTTP and WebSockets of a gateway, with the limits of time and rate that uvicorn has not."""

from __future__ import annotations

import asyncio
import logging
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CloseCode, Frame

from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.rate_limit import RateLimit, RateLimits
from bioscara.web.connections import AcceptedConnection, Connections

HEAD_TIMEOUT, BODY_TIMEOUT = 10.0, 40.0
"""Time in which the head of a request has to come, with TLS where it is the first one, and its body
after that [s]: routes that read a body have shorter limits."""
MESSAGES, VIEWER_MESSAGES = 200, 100
"""Frames that may come on a WebSocket in a second, and on all those of a client that may only look
(the windows of a browser, or the programs of a computer)."""
VIEWER_SHARE = 30
"""Of the latter, those that each WebSocket may always send."""
_UNIT, _VIEWER_UNIT = 64 << 10, 8 << 10
"""A longer frame counts as several: one for each so many bytes."""
_SLICE = 1 << 10
"""Bytes that are parsed before the frames in them are counted: of the shortest some 170."""
_FAREWELL = 2.0
"""Time for which a client that was cut off keeps its connection, and can read the reason [s]: a new
WebSocket costs as much as some fifty frames."""

_log = logging.getLogger(__name__)


class TimedHttp(H11Protocol):
    """A connection on which each request has to come in time, head and body.

    Args:
        connections: Has it.
        **options: Of uvicorn.
    """

    def __init__(self, connections: Connections, **options: Any) -> None:
        super().__init__(**options)
        self._connections = connections
        self._phase: object = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin."""
        super().connection_made(transport)
        # Also of the WebSocket that it may become: waiting samples can be replaced before this.
        # Not 0, with which asyncio's TLS pauses for an empty buffer, too.
        transport.set_write_buffer_limits(high=1)
        self._connection = self._connections.find(transport.get_extra_info("socket").fileno())
        self._connection.carried_by(transport)
        self.app_state = {**self.app_state, "connection": self._connection}
        # The time for the first head goes on that began with its acceptance.
        self._phase = (HEAD_TIMEOUT, None)

    def data_received(self, data: bytes) -> None:
        """Take bytes of the client."""
        super().data_received(data)
        self._limit()

    def on_response_complete(self) -> None:
        """Go on with the next request."""
        super().on_response_complete()
        self._limit()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Become a WebSocket."""
        self._phase = None
        self._connection.end_after(None)
        super().handle_websocket_upgrade(event)

    def _limit(self) -> None:
        if self._phase is None:
            return
        if self.conn.their_state is h11.SEND_BODY:
            time = BODY_TIMEOUT
        elif self.cycle is None or self.cycle.response_complete:
            time = HEAD_TIMEOUT
        else:
            time = None
        if (phase := (time, self.cycle)) != self._phase:
            self._phase = phase
            self._connection.end_after(time)


class CountedWebSocket(WebSocketsSansIOProtocol):
    """A WebSocket whose frames are counted, of each kind; beyond the rate it is closed.

    Args:
        viewers: Counts the frames of clients that may only look.
        **options: Of uvicorn.
    """

    _cut_off = False

    def __init__(self, viewers: RateLimits, **options: Any) -> None:
        super().__init__(**options)
        self._viewers, self._rate = viewers, RateLimit(MESSAGES, MESSAGES)
        self._share = RateLimit(VIEWER_SHARE, VIEWER_SHARE)

    def data_received(self, data: bytes) -> None:
        """Take bytes of the client, a few at a time: parsing thousands of pings takes a second."""
        for begin in range(0, len(data), _SLICE):
            if self._cut_off or self.transport.is_closing():
                return
            super().data_received(data[begin : begin + _SLICE])

    def handle_events(self) -> None:
        """Take what was parsed."""
        frames = [event for event in self.conn.events if isinstance(event, Frame)]
        if frames and not self._may_send(frames):
            return
        super().handle_events()

    def _may_send(self, frames: list[Frame]) -> bool:
        connection: AcceptedConnection = self.app_state["connection"]
        length = sum(len(frame.data) for frame in frames)
        if connection.scope == Scope.VIEW:
            most = VIEWER_MESSAGES
            cost = len(frames) + length / _VIEWER_UNIT
            taken = self._share.take(cost) or self._viewers.take(connection.client, cost)
        else:
            most = MESSAGES
            taken = self._rate.take(len(frames) + length / _UNIT)
        if taken:
            return True
        address = self.client[0] if self.client else ""
        reason = f"more than {most} messages in a second"
        _log.warning("client %s is cut off: it sent %s", address, reason)
        self._cut_off = self.close_sent = True
        self.stop_keepalive()
        self.transport.pause_reading()
        self.conn.events.clear()
        self.conn.data_to_send()  # answers to its pings
        self.conn.fail(CloseCode.POLICY_VIOLATION, reason)
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.queue.put_nowait({"type": "websocket.disconnect", "code": 1008, "reason": reason})
        if self.close_timer is not None:
            self.close_timer.cancel()
        self.close_timer = self.loop.call_later(_FAREWELL, self.transport.close)
        return False
