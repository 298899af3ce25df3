"""What becomes of the lease of a client of the gateway whose connection ends."""

from __future__ import annotations

import json
import socket
import ssl
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress

import pytest

from bioscara.robot.tasks.scope import Scope
from bioscara.server.clients.connection import RETURN
from bioscara.server.clients.lease import Lease
from entries import entry
from hostile.flood import frame
from served import eventually
from web.gateways import Site, site

NOT_VERIFIED = ssl.create_default_context()
NOT_VERIFIED.check_hostname, NOT_VERIFIED.verify_mode = False, ssl.CERT_NONE
RESET = struct.pack("ii", 1, 0)
"""With this option of its socket, the end of a connection is RST and not FIN."""


@pytest.fixture(scope="module")
def secure() -> Iterator[Site]:
    with site("secure", self_signed=True) as made:
        yield made


def connected(
    place: Site, credential: dict[str, str], session: str, *requests: dict[str, object]
) -> socket.socket:
    """Open a WebSocket whose bytes are those of this test, and introduce its client."""
    name, _, port = place.host.rpartition(":")
    connection = socket.create_connection((name, int(port)), timeout=10.0)
    if place.origin.startswith("https"):
        connection = NOT_VERIFIED.wrap_socket(connection)
    headers = {
        "Host": place.host,
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
        "Sec-WebSocket-Version": "13",
        **credential,
    }
    lines = ["GET /ws HTTP/1.1", *(f"{key}: {value}" for key, value in headers.items()), "", ""]
    hello = {"kind": "hello", "version": 1, "client": "program", "session": session}
    messages = (hello, *({"kind": "request", "id": 1, "command": each} for each in requests))
    connection.sendall("\r\n".join(lines).encode())
    connection.recv(4096)
    connection.sendall(b"".join(frame(1, json.dumps(each).encode()) for each in messages))
    return connection


@contextmanager
def holding(place: Site, credential: dict[str, str], session: str) -> Iterator[socket.socket]:
    """Hold the lease for a minute, unless it ends with its client."""
    command = {"kind": "acquire_lease", "time_to_live": 60.0}
    with connected(place, credential, session, command) as connection:
        assert place.served
        lease = place.served.owner.lease
        eventually(lambda: lease.holder, what="the program has the lease")
        yield connection


def finished(connection: socket.socket) -> None:
    socket.socket.shutdown(connection, socket.SHUT_WR)


def reset(connection: socket.socket) -> None:
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
    connection.close()


def closed(connection: socket.socket) -> None:
    connection.sendall(frame(8, (1000).to_bytes(2, "big")))


def notified(connection: socket.socket) -> None:
    assert isinstance(connection, ssl.SSLSocket)
    with suppress(OSError):
        connection.unwrap()


def until_free(lease: Lease) -> None:
    eventually(lambda: not lease.holder, what="the lease has ended")


def test_the_lease_of_a_program_ends_with_its_stream_however_that_ends(
    left: Site, secure: Site
) -> None:
    ends: list[tuple[Site, Callable[[socket.socket], None]]] = [
        *((place, end) for place in (left, secure) for end in (finished, reset, closed)),
        (secure, notified),
    ]
    for place, end in ends:
        assert place.served
        lease = place.served.owner.lease
        with (
            entry(f"{end.__name__} {place.origin}"),
            holding(place, place.bearer(Scope.OPERATE), end.__name__) as connection,
        ):
            begin = time.monotonic()
            end(connection)
            until_free(lease)
            assert time.monotonic() - begin > 0.9 * RETURN


def test_a_program_that_is_back_in_time_and_a_page_keep_the_lease(left: Site) -> None:
    assert left.served
    lease = left.served.owner.lease

    def kept() -> bool:
        """Return whether a client has the lease, once it would have ended."""
        time.sleep(1.5 * RETURN)
        return bool(lease.holder)

    credential = left.bearer(Scope.OPERATE)
    with ExitStack() as stack:
        stack.enter_context(holding(left, credential, "flapping")).close()
        for _ in range(3):
            # In all longer than a program may be away, and each time shorter.
            time.sleep(0.5 * RETURN)
            last = stack.enter_context(connected(left, credential, "flapping"))
            time.sleep(0.1 * RETURN)
            last.close()
        another = stack.enter_context(connected(left, credential, "flapping"))
        assert kept()
        second = stack.enter_context(connected(left, credential, "flapping"))
        another.close()
        assert kept(), "of two connections the older one has ended"
        third = stack.enter_context(connected(left, credential, "flapping"))
        time.sleep(0.1 * RETURN)
        third.close()
        assert kept(), "of two connections the newer one has ended"
        second.close()
        until_free(lease)
    with left.signed_in(Scope.OPERATE) as browser:
        with holding(left, left.cookie(browser), "page") as page:
            page.close()
            assert kept(), "the page has no connection"
        assert browser.post("/api/stop").status_code == 200
    assert not lease.holder
