"""Listening: the socket, TLS and the server that runs the routes."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import uvicorn
from starlette.types import ASGIApp

from bioscara.api import framing, runtime
from bioscara.api.gateway_pages import Announcement
from bioscara.errors import ConfigurationError
from bioscara.processes.child_process import Questions
from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.addresses import (
    LOCAL_NAMES,
    OwnAddresses,
    is_any,
    is_loopback,
    require_host_name,
)
from bioscara.web.access.browser_sessions import BrowserSessions
from bioscara.web.access.certificates import fingerprint, self_signed
from bioscara.web.access.rate_limit import RateLimits
from bioscara.web.access.tokens import default_path, load_tokens, view_token
from bioscara.web.app import guarded, make_app
from bioscara.web.connections import Connections, Listener, allow_files
from bioscara.web.protocols import HEAD_TIMEOUT, VIEWER_MESSAGES, CountedWebSocket, TimedHttp
from bioscara.web.settings import WebSettings

LOOPBACK = "127.0.0.1"
"""The address that only this computer reaches."""
SENT_AHEAD = 16 << 10
"""Bytes that the system keeps for a client that does not read; Linux doubles it."""
_DEAD = 30_000
"""Time after which the system ends a connection whose client takes nothing [ms]."""
_PATIENCE = 3
"""Time in which the connections have to end at the end [s]."""
_HEADERS_MAX = 16 << 10
"""Longest begin of a request, with all headers [byte]."""
_QUEUE = 128
"""Connections that wait until they are accepted."""
_POLL = 0.1


@dataclass(frozen=True, slots=True)
class GatewaySettings:
    """How a gateway listens.

    Attributes:
        arm: Name of the owner.
        host: Name or address to listen on.
        port: TCP port; 0 for a free one.
        allowed_hosts: Further names by which browsers call this computer.
        token_file: File of the tokens; None for the one next to the owner's socket.
        certificate: File of the certificate; None for none, or a self-signed one.
        key: File of its key; given if the certificate is.
        self_signed: Whether to make a certificate.
        recordings: Folder of the recordings that browsers may load.
        read_only: Whether browsers may only look: there is one token, which no file has, and the
            page is in no list.
    """

    arm: str
    host: str = LOOPBACK
    port: int = 8080
    allowed_hosts: Sequence[str] = ()
    token_file: Path | None = None
    certificate: Path | None = None
    key: Path | None = None
    self_signed: bool = False
    recordings: Path = Path("recordings")
    read_only: bool = False

    @property
    def tls(self) -> bool:
        """Whether it speaks TLS."""
        return self.self_signed or self.certificate is not None


class PageServer:
    """Serves routes to browsers; :meth:`run` serves until it is asked to end.

    Args:
        listener: Of :func:`listening`; closed at the end.
        app: The routes, behind the check of each request.
        certificate: File of the certificate; None for no TLS.
        key: File of its key.

    Raises:
        ConfigurationError: The certificate cannot be used, or the system allows too few files.
    """

    def __init__(
        self,
        listener: Listener,
        app: ASGIApp,
        certificate: Path | None = None,
        key: Path | None = None,
    ) -> None:
        allow_files()
        self._listener = listener
        self._server = _Server(_config(app, listener.connections, certificate, key))

    @property
    def started(self) -> bool:
        """Whether it answers."""
        return self._server.started

    def run(self, ended: Callable[[], bool]) -> None:
        """Serve until ``ended`` returns true.

        Raises:
            ConfigurationError: The server cannot begin.
        """
        asyncio.run(self._serve(ended))

    def close(self) -> None:
        """Give the port free; may be called again."""
        self._listener.close()

    async def _serve(self, ended: Callable[[], bool]) -> None:
        questions = Questions()

        async def watch() -> None:
            while not ended():
                questions.answer()
                await asyncio.sleep(_POLL)
            self._server.should_exit = True

        watching = asyncio.get_running_loop().create_task(watch())
        try:
            await self._server.serve(sockets=[self._listener])
        finally:
            watching.cancel()
            self.close()
        if not self._server.started:
            raise ConfigurationError("the web server cannot begin; its log says why")


class Gateway(PageServer):
    """A gateway that listens.

    Attributes:
        url: Address of the page, without a token.
        tokens: The tokens.
        token_file: Their file, unless it is read-only.
        fingerprint: SHA-256 fingerprint of the certificate; empty without TLS.
        sessions: The signed-in browsers.

    Raises:
        AccessError: A file with secrets can be read by others.
        ConfigurationError: It would listen beyond this computer without TLS, or an address or a
            file cannot be used.
        OwnerLostError: No owner of that name runs.
    """

    def __init__(self, settings: GatewaySettings) -> None:
        runtime.find(settings.arm)
        names = _names(settings)
        self.token_file = settings.token_file or default_path(settings.arm)
        self.tokens = view_token() if settings.read_only else load_tokens(self.token_file)
        certificate, key = _certificate(settings, self.token_file.parent, names)
        self.fingerprint = "" if certificate is None else fingerprint(certificate)
        self.sessions = BrowserSessions()
        listener = listening(settings.host, settings.port)
        try:
            port = listener.getsockname()[1]
            own = OwnAddresses(names, port, tls=settings.tls)
            web = WebSettings(
                settings.arm,
                own,
                self.tokens,
                settings.tls,
                self.sessions,
                settings.recordings,
            )
            self.app = make_app(web)
            super().__init__(listener, guarded(self.app, web), certificate, key)
        except BaseException:
            listener.close()
            raise
        shown = f"[{names[0]}]" if ":" in names[0] else names[0]
        self.url = f"{'https' if settings.tls else 'http'}://{shown}:{port}/"
        announced = not settings.read_only
        self._announcement = Announcement(settings.arm, port, self.url) if announced else None

    def url_with_token(self, scope: Scope) -> str:
        """Return the address of the page with a token in the fragment, which is never sent."""
        return f"{self.url}#token={self.tokens.of(scope)}"

    def close(self) -> None:
        """Give the port free, and leave the list; may be called again."""
        if self._announcement is not None:
            self._announcement.close()
        super().close()


class _Server(uvicorn.Server):
    """A server that leaves the signals to the command."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Handle no signal."""
        yield


def _is_error(record: logging.LogRecord) -> bool:
    """Leave out the record that uvicorn makes of a WebSocket that was answered with a refusal."""
    return record.msg != "ASGI callable returned without completing handshake."


def _config(
    app: ASGIApp, connections: Connections, certificate: Path | None, key: Path | None
) -> uvicorn.Config:
    for name in ("uvicorn", "uvicorn.error", "websockets"):
        # At lower levels they write headers, and so secrets, and a line for each bad request.
        logging.getLogger(name).setLevel(logging.ERROR)
    logging.getLogger("uvicorn.error").addFilter(_is_error)
    try:
        config = uvicorn.Config(
            app,
            http=partial(TimedHttp, connections),  # type: ignore[arg-type]
            ws=partial(CountedWebSocket, RateLimits(VIEWER_MESSAGES, VIEWER_MESSAGES)),  # type: ignore[arg-type]
            ws_max_size=framing.REQUEST_MAX,
            ws_per_message_deflate=False,  # compression takes longer than it saves, and can leak
            loop="asyncio",
            lifespan="on",
            log_config=None,
            access_log=False,
            proxy_headers=False,  # else a header could claim another address
            server_header=False,
            backlog=_QUEUE,
            timeout_graceful_shutdown=_PATIENCE,
            h11_max_incomplete_event_size=_HEADERS_MAX,
            ssl_certfile=certificate,
            ssl_keyfile=key,
        )
        config.load()
    except OSError as error:  # an ssl.SSLError also
        raise ConfigurationError(
            f"{certificate} and {key} cannot be used for TLS: {error.strerror or error}"
        ) from error
    return config


def _names(settings: GatewaySettings) -> tuple[str, ...]:
    """Return the names of the gateway, first the one to be shown.

    Raises:
        ConfigurationError: Others would reach it without TLS, or by no name.
    """
    host = require_host_name(settings.host)
    allowed = tuple(map(require_host_name, settings.allowed_hosts))
    if not is_loopback(host) and not settings.tls:
        raise ConfigurationError(
            f"--host {host} is reachable from other computers, and tokens would be readable on "
            "the network: give --tls-cert and --tls-key, or --tls-self-signed"
        )
    if is_any(host):
        if not allowed:
            raise ConfigurationError(
                f"--host {host} has no name of its own: give --allowed-host with the name or "
                "address by which browsers call this computer"
            )
        host_names: tuple[str, ...] = ()
    else:
        host_names = (host,)
    return tuple(dict.fromkeys((*host_names, *allowed, *LOCAL_NAMES)))


def _certificate(
    settings: GatewaySettings, folder: Path, names: Sequence[str]
) -> tuple[Path | None, Path | None]:
    if not settings.self_signed:
        return settings.certificate, settings.key
    certificate, key = folder / f"{settings.arm}.crt", folder / f"{settings.arm}.key"
    self_signed(certificate, key, names)
    return certificate, key


def listening(host: str, port: int) -> Listener:
    """Return a socket that listens.

    Args:
        host: Name or address to listen on.
        port: TCP port; 0 for a free one.

    Raises:
        ConfigurationError: It cannot be listened on.
    """
    host = require_host_name(host)
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    family, kind, protocol, _, address = found[0]
    listener = Listener(family, kind | socket.SOCK_CLOEXEC, protocol)
    listener.connections, listener.patience = Connections(), HEAD_TIMEOUT
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        # Inherited by each connection. Without it the system would keep megabytes for a client
        # that does not read, and show it the state of a minute ago.
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SENT_AHEAD)
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _DEAD)
        listener.bind(address)
        listener.listen(_QUEUE)
    except OSError as error:
        listener.close()
        raise ConfigurationError(
            f"{host} port {port} cannot be listened on: {error.strerror}; give another --port"
        ) from error
    listener.setblocking(False)
    return listener
