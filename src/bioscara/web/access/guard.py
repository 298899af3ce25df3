"""The check that each request passes before any route sees it.

Each path that is not public needs a credential, also one that has no route: a route that is added
later is closed until it is listed here or asks for a scope of its own.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any

import msgspec
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope as AsgiScope, Send

from bioscara.errors import AccessError
from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.addresses import OwnAddresses
from bioscara.web.access.browser_sessions import BrowserSession, BrowserSessions
from bioscara.web.access.rate_limit import RateLimits
from bioscara.web.access.tokens import Tokens
from bioscara.web.connections import AcceptedConnection

REQUESTS = 50
"""Requests that a credential, or an address without one, may send in a second; a STOP of a
credential is none of them, and is never refused."""
FILES = 1000
"""Files of the page that it may load in a second: a page has about a hundred, held in memory."""
STOP = re.compile(r"/api/stop|/api/arms/(?:[^/]+/)?stop")
"""Paths that stop an arm."""
SESSION = "/session"
"""Path at which browsers sign in."""
SIGN_INS, SIGN_IN_PERIOD = 5, 10.0
"""Number of tokens that an address may try in a time [s]."""
TOO_MANY_SIGN_INS = f"more than {SIGN_INS} tokens were tried in {SIGN_IN_PERIOD:g} s; wait"
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'; object-src 'none'",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
"""Headers of every answer; files of the page may be kept, and say so."""
_SAFE = frozenset({"GET", "HEAD"})
_BEARER = re.compile(r"Bearer ([!-~]{1,256})", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Credential:
    """Credential of a request.

    Attributes:
        scope: Its rights.
        session: The session of a browser; None for a program that sends a token.
        value: Value of the browser's cookie; empty for a program.
        address: Address that it came from.
    """

    scope: Scope
    session: BrowserSession | None
    value: str
    address: str


class _RefusedError(Exception):
    """A request is refused before a route sees it."""

    def __init__(self, status: HTTPStatus, text: str) -> None:
        self.status, self.text = status, text
        super().__init__(text)


class Guard:
    """Checks address, origin, credential and rate of each request.

    A request that passes has its :class:`Credential`, or None, in ``request.state.credential``, and
    in ``request.state.has_place`` whether its connection has a place.

    Args:
        app: The routes.
        own: Host names and origins of the gateway.
        tokens: The tokens.
        sessions: The signed-in browsers.
        sign_ins: How often an address may try a token.
        cookie: Name of the cookie.
        public: Paths that need no credential.
        files: Those of them that are files of the page.
    """

    def __init__(
        self,
        app: ASGIApp,
        own: OwnAddresses,
        tokens: Tokens,
        sessions: BrowserSessions,
        sign_ins: RateLimits,
        cookie: str,
        public: Collection[str],
        files: Collection[str],
    ) -> None:
        self._app, self._own, self._tokens = app, own, tokens
        self._sessions, self._cookie, self._public = sessions, cookie, frozenset(public)
        self._files, self._sign_ins = frozenset(files), sign_ins
        self._requests, self._loads = RateLimits(REQUESTS, REQUESTS), RateLimits(FILES, FILES)

    async def __call__(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        """Let a request through, or answer it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        try:
            credential, has_place = self._checked(scope)
        except _RefusedError as refused:
            await _answer_refused(scope, refused, _with_headers(send))
            return
        scope.setdefault("state", {}).update(credential=credential, has_place=has_place)
        await self._app(scope, receive, _with_headers(send, close=not has_place))

    def _checked(self, scope: AsgiScope) -> tuple[Credential | None, bool]:
        """Return the credential of a request, and whether its connection has a place."""
        headers = _Headers(scope)
        own, public = self._own, scope["path"] in self._public
        if not own.is_host(headers.all("host")):
            raise _RefusedError(
                HTTPStatus.MISDIRECTED_REQUEST,
                "the Host is no name of this gateway; open it by the address that it printed, or "
                "start it with --allowed-host",
            )
        safe = scope["type"] == "http" and scope["method"] in _SAFE
        origins = headers.all("origin")
        if origins and not own.is_origin(origins):
            raise _RefusedError(HTTPStatus.FORBIDDEN, "the request comes from another site")
        if not public and headers.foreign_site():
            raise _RefusedError(HTTPStatus.FORBIDDEN, "the request comes from another site")
        address = scope["client"][0] if scope.get("client") else ""
        credential = self._credential(headers, address)
        # A token that is to be exchanged has a limit there, which only wrong ones use up.
        signs_in = scope["path"] == SESSION and not safe
        limits = self._loads if scope["path"] in self._files else self._requests
        stops = (
            credential is not None
            and scope.get("method") == "POST"
            and STOP.fullmatch(scope["path"])
        )
        if not (signs_in or stops or limits.take(requester(credential, address))):
            raise _RefusedError(HTTPStatus.TOO_MANY_REQUESTS, "too many requests in a second")
        if credential is None and not public:
            raise _RefusedError(
                HTTPStatus.UNAUTHORIZED,
                "this needs a token; open the address that 'bioscara web' printed",
            )
        by_program = credential is not None and credential.session is None
        if not (origins or by_program or safe):
            raise _RefusedError(
                HTTPStatus.FORBIDDEN,
                "the request has no Origin; a browser sends one, a program a token as Bearer",
            )
        connection: AcceptedConnection | None = scope.get("state", {}).get("connection")
        if credential is None or connection is None:
            return credential, True
        has_place = connection.admit(requester(credential, address), credential.scope)
        if has_place:
            return credential, True
        # Of a WebSocket its route sees to it that only a STOP gets through.
        if scope["type"] == "websocket" or STOP.fullmatch(scope["path"]):
            return credential, False
        raise _RefusedError(
            HTTPStatus.SERVICE_UNAVAILABLE,
            "too many clients are connected: only STOP is answered; try again later",
        )

    def _credential(self, headers: _Headers, address: str) -> Credential | None:
        given = headers.all("authorization")
        if given:
            # A token that is sent is judged alone: a cookie does not make up for a wrong one.
            match = _BEARER.fullmatch(given[0]) if len(given) == 1 else None
            scope = self._tokens.scope_of(match[1]) if match else None
            if scope is not None:
                return Credential(scope, None, "", address)
            if not self._sign_ins.take(address):
                raise _RefusedError(HTTPStatus.TOO_MANY_REQUESTS, TOO_MANY_SIGN_INS)
            raise _RefusedError(HTTPStatus.UNAUTHORIZED, "the token is not one of this gateway")
        for value in headers.cookies(self._cookie):
            session = self._sessions.find(value)
            if session is not None:
                return Credential(session.scope, session, value, address)
        return None


def requester(credential: Credential | None, address: str) -> str:
    """Return whose requests are counted together: others cannot use up those of a credential."""
    if credential is None:
        return address
    return f"{credential.scope.name} {credential.value or address}"


class _Headers:
    """The headers of a request, each with all its values."""

    def __init__(self, scope: AsgiScope) -> None:
        self._pairs: list[tuple[bytes, bytes]] = scope["headers"]

    def all(self, name: str) -> list[str]:
        wanted = name.encode()
        return [value.decode("latin-1") for key, value in self._pairs if key.lower() == wanted]

    def cookies(self, name: str) -> list[str]:
        found = []
        for header in self.all("cookie"):
            for part in header.split(";"):
                key, _, value = part.strip().partition("=")
                if key == name:
                    found.append(value)
        return found

    def foreign_site(self) -> bool:
        """Whether the browser says that another site's page sent the request."""
        return any(value not in {"same-origin", "none"} for value in self.all("sec-fetch-site"))


def _with_headers(send: Send, *, close: bool = False) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] in {
            "http.response.start",
            "websocket.http.response.start",
            "websocket.accept",
        }:
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers.setdefault(name, value)
            if close and message["type"] == "http.response.start":
                headers["Connection"] = "close"
        await send(message)

    return sending


async def _answer_refused(scope: AsgiScope, refused: _RefusedError, send: Send) -> None:
    # A WebSocket that is not accepted yet can be answered as a request.
    prefix = "websocket.http" if scope["type"] == "websocket" else "http"
    body = failure_body(refused.text)
    headers: list[tuple[bytes, bytes]] = [
        (b"content-type", b"application/json"),
        (b"content-length", str(len(body)).encode()),
    ]
    if refused.status == HTTPStatus.UNAUTHORIZED:
        headers.append((b"www-authenticate", b"Bearer"))
    if refused.status in {HTTPStatus.TOO_MANY_REQUESTS, HTTPStatus.SERVICE_UNAVAILABLE}:
        # A client that goes on has to connect again, which takes its turn after others.
        headers.append((b"connection", b"close"))
    if refused.status == HTTPStatus.TOO_MANY_REQUESTS:
        headers.append((b"retry-after", str(round(SIGN_IN_PERIOD)).encode()))
    start: dict[str, Any] = {"status": int(refused.status), "headers": headers}
    await send({"type": f"{prefix}.response.start", **start})
    await send({"type": f"{prefix}.response.body", "body": body})


def failure_body(text: str) -> bytes:
    """Return the body of an answer that refuses a request, a failure as the owner's are."""
    return msgspec.json.encode(
        {"error": AccessError.__name__, "code": AccessError.code, "text": text, "data": {}}
    )
