"""A WebSocket to a gateway, with messages in JSON."""

from __future__ import annotations

import logging
import select
import socket
import ssl
import threading
import time

import msgspec
from websockets.client import ClientProtocol
from websockets.exceptions import InvalidHandshake, InvalidMessage, InvalidState, InvalidStatus
from websockets.frames import Frame, Opcode
from websockets.protocol import State
from websockets.uri import parse_uri

from bioscara.api import framing, json_answers, messages as m
from bioscara.errors import AccessError, OwnerLostError, ProtocolError
from bioscara.printing import brief, printable

_CHUNK = 1 << 16
_UNIT = 64 << 10
"""A gateway counts a longer message as several: one for each so many bytes."""
_RATE = 80.0
"""Messages that are sent in a second, and at once; half the rate of a gateway, as the network may
hold some up and deliver them together, and a stop must not wait."""
_AGAIN = frozenset({1000, 1001, 1006, 1011, 1012})
"""Codes after which it may be tried to connect again; not 1013, of a gateway that is full."""
_REFUSED = {401, 403, 421}
"""Status of answers that do not change when the request is repeated."""
_LATER = {429, 503}

_log = logging.getLogger(__name__)
# At lower levels the library writes headers, and so the token.
_log.setLevel(logging.ERROR)


class WebSocketConnection:
    """A WebSocket to a gateway; a ``TransportConnection``.

    One lock serves the protocol and TLS, which threads must not use at once; no thread waits in it.

    Args:
        connection: Connected to the gateway, with TLS if it has it.
        name: Address of the gateway, for messages to people.
        patience: Time in which the other end has to answer before :meth:`greeted`, and later to
            take a part of a message [s].
    """

    def __init__(self, connection: socket.socket, name: str, patience: float) -> None:
        connection.setblocking(False)
        self._socket, self._name, self._patience = connection, name, patience
        uri = parse_uri(f"ws{name.removeprefix('http')}/ws")
        self._protocol = ClientProtocol(uri, max_size=framing.ANSWER_MAX, logger=_log)
        self._lock = threading.Lock()
        self._outgoing = bytearray()
        self._parts: list[bytes] = []
        self._limit: float | None = patience
        self._left, self._counted = _RATE, time.monotonic()
        self._ended = False

    def shake_hands(self, token: str) -> None:
        """Open the WebSocket.

        Raises:
            AccessError: The gateway refuses the token.
            OwnerLostError: It has no place, or ended the connection.
            ProtocolError: It is no gateway.
            OSError: The connection broke; TimeoutError, if it does not answer in time.
        """
        request = self._protocol.connect()
        request.headers["Authorization"] = f"Bearer {token}"
        self._protocol.send_request(request)
        self._flush()
        end = time.monotonic() + self._patience
        while self._protocol.state is State.CONNECTING and self._protocol.handshake_exc is None:
            self._wait(self._pumped(), end - time.monotonic())
        if (refused := self._protocol.handshake_exc) is not None:
            raise self._refusal(refused)

    def send(self, data: bytes) -> None:
        """Send a message, at once."""
        with self._lock:
            self._refill()
            # An urgent message that did not wait delays those after it.
            self._left -= _cost(len(data))
            try:
                self._protocol.send_text(data)
            except InvalidState as error:
                raise BrokenPipeError("the connection has ended") from error
        self._flush()

    def receive(self) -> list[m.FromOwner]:
        """Wait for further messages, and return them."""
        end = None if self._limit is None else time.monotonic() + self._limit
        while True:
            with self._lock:
                events = self._protocol.events_received()
            texts = [self._text(event) for event in events if isinstance(event, Frame)]
            messages = [json_answers.decode(text) for text in texts if text is not None]
            if messages:
                return messages
            self._require_open()
            self._wait(self._pumped(), None if end is None else end - time.monotonic())

    def wait_turn(self, size: int) -> None:
        """Wait until a message of so many bytes keeps within the rate."""
        while True:
            with self._lock:
                self._refill()
                missing = _cost(size) - self._left
            if missing <= 0.0 or self._ended:
                return
            time.sleep(missing / _RATE)

    def greeted(self) -> None:
        """Wait for messages as long as it takes from now on."""
        self._limit = None

    def end(self) -> None:
        """End the connection."""
        self._ended = True
        # Not that of TLS, which would let the other threads read without it.
        socket.socket.shutdown(self._socket, socket.SHUT_RDWR)

    def close(self) -> None:
        """Forget the connection."""
        self._ended = True
        self._socket.close()

    def _refill(self) -> None:
        now = time.monotonic()
        self._left = min(self._left + (now - self._counted) * _RATE, _RATE)
        self._counted = now

    def _text(self, frame: Frame) -> bytes | None:
        """Return a message of which this frame is the last part; None if it is none."""
        if frame.opcode in {Opcode.TEXT, Opcode.CONT}:
            self._parts.append(bytes(frame.data))
            if frame.fin:
                text, self._parts = b"".join(self._parts), []
                return text
        elif frame.opcode is Opcode.BINARY:
            raise ProtocolError(f"{self._name} sends what no gateway does")
        return None

    def _flush(self) -> None:
        """Send all that waits; raises TimeoutError if the other end takes nothing for a time."""
        while True:
            with self._lock:
                events = self._write()
            if not events:
                return
            self._wait(events, self._patience)

    def _write(self) -> int:
        """Send what the connection takes; return for what to wait until the rest can be sent."""
        self._outgoing += b"".join(self._protocol.data_to_send())
        try:
            while self._outgoing:
                sent = self._socket.send(memoryview(self._outgoing)[:_CHUNK])
                del self._outgoing[:sent]
        except ssl.SSLWantReadError:
            return select.POLLIN
        except (ssl.SSLWantWriteError, BlockingIOError):
            return select.POLLOUT
        return 0

    def _pumped(self) -> int:
        """Take what has come and answer pings; return for what to wait, 0 if something came."""
        with self._lock:
            try:
                data = self._socket.recv(_CHUNK)
            except (ssl.SSLWantReadError, BlockingIOError):
                return select.POLLIN | self._write()
            except ssl.SSLWantWriteError:
                return select.POLLOUT
            if data:
                self._protocol.receive_data(data)
            else:
                self._protocol.receive_eof()
                self._ended = True
            self._write()
            return 0

    def _wait(self, events: int, timeout: float | None) -> None:
        """Wait until the connection is ready, or has ended."""
        if not events:
            return
        if timeout is not None and timeout <= 0.0:
            raise TimeoutError
        polled = select.poll()
        try:
            polled.register(self._socket, events)
        except ValueError as error:
            raise OSError("the connection was closed") from error
        if not polled.poll(None if timeout is None else 1e3 * timeout):
            raise TimeoutError

    def _require_open(self) -> None:
        """Raise if the other end has ended the connection."""
        closed = self._protocol.close_rcvd
        if closed is not None:
            reason = printable(closed.reason) or f"code {int(closed.code)}"
            if closed.code in _AGAIN:
                raise OwnerLostError(f"{self._name} ended the connection: {reason}")
            raise AccessError(f"{self._name} refuses this program: {reason}")
        if self._ended or self._protocol.parser_exc is not None:
            raise OwnerLostError(f"{self._name} ended the connection")

    def _refusal(self, error: Exception) -> Exception:
        """Return the error for an answer that opens no WebSocket."""
        if isinstance(error, InvalidStatus):
            status, text = error.response.status_code, _words(error.response.body)
            if status in _REFUSED and text:
                return AccessError(f"{self._name} refuses this program: {text}")
            if status in _LATER:
                return OwnerLostError(
                    f"{self._name} has no place for this program: {text or status}"
                )
            return ProtocolError(
                f"{self._name} is no gateway of an arm: it answers /ws with status {status}"
            )
        if isinstance(error, InvalidMessage) and isinstance(error.__cause__, EOFError):
            return OwnerLostError(
                f"{self._name} ended the connection without an answer; if its gateway has TLS, "
                "give the address as https://"
            )
        if isinstance(error, InvalidHandshake):
            return ProtocolError(f"{self._name} is no gateway of an arm: {brief(str(error))}")
        return error


def _cost(size: int) -> float:
    """Return as how many messages a gateway counts one of so many bytes."""
    return 1.0 + size / _UNIT


def _words(body: bytes | bytearray) -> str:
    """Return the text of a gateway's refusal; empty if it is none."""
    try:
        return printable(str(msgspec.json.decode(bytes(body), type=dict[str, object])["text"]))
    except (msgspec.DecodeError, KeyError):
        return ""
