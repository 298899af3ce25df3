"""A hostile client of a gateway, until it is killed: ``flood.py HOST PORT TOKEN KIND [COUNT]``.

It opens as many connections as given, each in a thread, sends as fast as it may, and connects
again when it is cut off. It writes ``flooding`` once each has begun.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial

POINTS = {
    "joint_names": ["j1", "j2", "j3", "j4"],
    "times": [0.01 * number for number in range(700)],
    "positions": [[0.1234567890123456] * 4] * 700,
}
COMMANDS = {
    "cheap": {"kind": "get_lease"},
    # Decoded in full before it is refused.
    "long": {"kind": "add_points", "points": POINTS},
}
RATE = 200
"""Messages that a client sends in a second [1/s]."""


def frame(opcode: int, payload: bytes = b"", *, last: bool = True) -> bytes:
    """Return a frame of a client, with a mask of zeros."""
    head = bytes([opcode | (0x80 if last else 0)])
    if len(payload) < 126:
        head += bytes([0x80 | len(payload)])
    else:
        head += b"\xff" + len(payload).to_bytes(8, "big")
    return head + bytes(4) + payload


def request(command: object) -> bytes:
    return frame(1, json.dumps({"kind": "request", "id": 1, "command": command}).encode())


HELLO = {"kind": "hello", "version": 1, "client": "flood", "session": os.urandom(8).hex()}
FRAMES = {
    "ping": frame(9) * 4096,
    "pong": frame(10) * 4096,
    "fragments": frame(1, last=False) + frame(0, last=False) * 4096,
    "empty": frame(1, b" ") * 4096,
    "requests": request(COMMANDS["cheap"]) * 256,
}
"""Frames that are sent again and again, at once."""


def connected(address: tuple[str, int]) -> socket.socket:
    """Connect, from the address that the other clients have, too."""
    return socket.create_connection(address, timeout=60.0)


def websocket(address: tuple[str, int], token: str) -> socket.socket:
    """Open a WebSocket and introduce its client."""
    connection = connected(address)
    lines = (
        "GET /ws HTTP/1.1",
        f"Host: {address[0]}:{address[1]}",
        f"Authorization: Bearer {token}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
        "Sec-WebSocket-Version: 13",
        "\r\n",
    )
    connection.sendall("\r\n".join(lines).encode() + frame(1, json.dumps(HELLO).encode()))
    connection.recv(4096)
    threading.Thread(target=_drain, args=(connection,), daemon=True).start()
    return connection


def _drain(connection: socket.socket) -> None:
    with suppress(OSError):
        while connection.recv(1 << 16):
            pass


def steadily(data: bytes) -> Iterator[bytes]:
    """Yield a message at the rate of :data:`RATE`."""
    begin, sent = time.monotonic(), 0
    while True:
        time.sleep(max(begin + sent / RATE - time.monotonic(), 0.0))
        sent += 1
        yield data


def attack(kind: str, address: tuple[str, int], token: str) -> None:
    """Flood until cut off."""
    if kind == "stops":
        head = (
            f"POST /api/arms/absent/stop HTTP/1.1\r\nHost: {address[0]}:{address[1]}\r\n"
            f"Authorization: Bearer {token}\r\nContent-Length: 0\r\n\r\n"
        )
        with connected(address) as connection:
            while True:
                connection.sendall(head.encode())
                if not connection.recv(1 << 16):
                    return
    if kind == "uploads":
        body = b"- [" + b"1.25, " * ((8 << 20) // 6 - 2) + b"1]\n"
        head = (
            f"POST /api/trajectories?name=a.yaml HTTP/1.1\r\nHost: {address[0]}:{address[1]}\r\n"
            f"Authorization: Bearer {token}\r\nContent-Length: {len(body)}\r\n\r\n"
        )
        with connected(address) as connection:
            connection.sendall(head.encode() + body)
            connection.recv(4096)
        return
    with websocket(address, token) as connection:
        if kind in COMMANDS:
            for data in steadily(request(COMMANDS[kind])):
                connection.sendall(data)
        while True:
            connection.sendall(FRAMES[kind])


def main() -> None:
    host, port, token, kind, *count = sys.argv[1:]
    begun = threading.Semaphore(0)

    def go(work: Callable[[], None]) -> None:
        begun.release()
        while True:
            with suppress(OSError):
                work()
            time.sleep(0.05)

    number = int(count[0]) if count else 1
    work = partial(attack, kind, (host, int(port)), token)
    for _ in range(number):
        threading.Thread(target=go, args=(work,), daemon=True).start()
    for _ in range(number):
        begun.acquire()
    sys.stdout.write("flooding\n")
    sys.stdout.flush()
    threading.Event().wait()


if __name__ == "__main__":
    main()
