"""A served simulated arm with its gateway, both in threads of the process of the tests."""

from __future__ import annotations

import itertools
import json
import secrets
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import httpx
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection

from bioscara import Robot
from bioscara.robot.tasks.scope import Scope
from bioscara.server.serve import Served, ServeSettings, serving
from bioscara.web.gateway import Gateway, GatewaySettings, PageServer
from programs import wait_until

LIMIT = 10.0
"""Time in which an answer has to come [s]."""


class Site:
    """A gateway and the arm behind it.

    Attributes:
        gateway: The gateway.
        served: The arm.
        evidence: Folder of its flight records.
    """

    def __init__(self, gateway: Gateway, served: Served | None, evidence: Path) -> None:
        self.gateway, self.served, self.evidence = gateway, served, evidence
        self.origin = gateway.url.rstrip("/")
        self.host = self.origin.partition("://")[2]

    def bearer(self, scope: Scope | str) -> dict[str, str]:
        given = self.gateway.tokens.of(scope) if isinstance(scope, Scope) else scope
        return {"Authorization": f"Bearer {given}"}

    def http(self, **options: Any) -> httpx.Client:
        # Reading the certificates of the system takes 40 ms, and few gateways here have TLS.
        return httpx.Client(
            **{"base_url": self.origin, "timeout": LIMIT, "verify": False, **options}
        )

    @contextmanager
    def signed_in(self, scope: Scope) -> Iterator[httpx.Client]:
        """Open a browser that has signed in."""
        with self.http(headers={"Origin": self.origin}) as client:
            answer = client.post("/session", json={"token": self.gateway.tokens.of(scope)})
            assert answer.status_code == 200, answer.text
            yield client

    def cookie(self, client: httpx.Client) -> dict[str, str]:
        """Return the headers with which a signed-in browser opens a WebSocket."""
        return {
            "Origin": self.origin,
            "Cookie": "; ".join(f"{name}={value}" for name, value in client.cookies.items()),
        }

    @contextmanager
    def websocket(self, headers: dict[str, str], **options: Any) -> Iterator[ClientConnection]:
        with connect(
            self.origin.replace("http", "ws", 1) + "/ws",
            additional_headers=headers,
            open_timeout=LIMIT,
            **{"compression": None, "max_size": None, **options},
        ) as socket:
            assert isinstance(socket, ClientConnection)
            yield socket

    @contextmanager
    def client(self, scope: Scope, name: str = "test", **options: Any) -> Iterator[WebClientOfTest]:
        """Open a WebSocket as a program with a token and introduce it."""
        with self.websocket(self.bearer(scope), **options) as socket:
            client = WebClientOfTest(socket)
            client.greet(name)
            yield client


class WebClientOfTest:
    """The far end of a WebSocket.

    Attributes:
        socket: The WebSocket.
        welcome: The greeting of the owner.
    """

    def __init__(self, socket: Connection) -> None:
        self.socket, self._numbers = socket, itertools.count(1)
        self.welcome: dict[str, Any] = {}

    def greet(self, name: str = "test", session: str | None = None) -> None:
        session = session or secrets.token_hex(8)
        self.send({"kind": "hello", "version": 1, "client": name, "session": session})
        self.welcome = self.receive(lambda message: message["kind"] == "welcome")

    def send(self, message: Any) -> None:
        self.socket.send(json.dumps(message))

    def closed(self) -> tuple[int, str]:
        """Return the code and the reason with which the WebSocket is closed."""
        while True:
            try:
                self.socket.recv(LIMIT)
            except ConnectionClosed as closed:
                received = closed.rcvd
                break
        return (received.code, received.reason) if received is not None else (1006, "")

    def receive(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Return the first message that is wanted."""
        while True:
            message: dict[str, Any] = json.loads(self.socket.recv(LIMIT))
            if wanted(message):
                return message

    def request(self, kind: str, epoch: int | None = None, **fields: Any) -> dict[str, Any]:
        """Send a request; return its result or failure."""
        number = next(self._numbers)
        command = {"kind": kind, **fields}
        self.send({"kind": "request", "id": number, "command": command, "epoch": epoch})
        answer = self.receive(lambda message: message.get("id") == number)
        found: dict[str, Any] = answer.get("result") or answer["failure"]
        return found


_Server = TypeVar("_Server", bound=PageServer)


@contextmanager
def running_gateway(gateway: _Server) -> Iterator[_Server]:
    """Run a gateway, or another server of the page, in a thread for a block of code."""
    ended, errors = threading.Event(), []

    def run() -> None:
        try:
            gateway.run(ended.is_set)
        except BaseException as error:  # noqa: BLE001  raised in the thread of the test
            errors.append(error)

    thread = threading.Thread(target=run, name="gateway")
    thread.start()
    try:
        wait_until(lambda: gateway.started or bool(errors), "the gateway listens")
        yield gateway
    finally:
        ended.set()
        thread.join(LIMIT)
        assert not thread.is_alive()
        if errors:
            raise errors[0]


@contextmanager
def site(
    name: str, speed: float = 1.0, overlay: Path | None = None, **options: Any
) -> Iterator[Site]:
    """Serve a simulated arm, and it on the web, for a block of code."""
    with tempfile.TemporaryDirectory() as folder, arm(name, Path(folder), speed, overlay) as served:
        settings = replace(GatewaySettings(name, port=0), **options)
        with running_gateway(Gateway(settings)) as gateway:
            yield Site(gateway, served, Path(folder))


@contextmanager
def arm(
    name: str, evidence: Path, speed: float = 1.0, overlay: Path | None = None
) -> Iterator[Served]:
    """Serve a simulated arm for a block of code."""
    robot = Robot.simulated(evidence=evidence)
    settings = ServeSettings(
        name, "sim", overlay=overlay, evidence=evidence, real_time_factor=speed
    )
    with serving(robot, settings) as served:
        yield served
