"""The routes of the gateway."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from http import HTTPStatus
from typing import Annotated, Any
from urllib.parse import quote

import msgspec
from fastapi import Depends, FastAPI, Request, Response, WebSocket
from starlette.requests import ClientDisconnect, HTTPConnection
from starlette.types import ASGIApp

from bioscara.api import messages as m
from bioscara.api.failures import failure_of
from bioscara.api.runtime import find
from bioscara.dashboard.assets import Asset, read_assets
from bioscara.errors import BioscaraError, InvalidArgumentError, OwnerLostError
from bioscara.version import __version__
from bioscara.web.addresses import OwnAddresses
from bioscara.web.browser_sessions import LIFETIME, BrowserSessions
from bioscara.web.guard import (
    SIGN_IN_PERIOD,
    SIGN_INS,
    TOO_MANY_SIGN_INS,
    Credential,
    Guard,
    failure_body,
)
from bioscara.web.owner_queries import OwnerQueries, RequestFailedError
from bioscara.web.rate_limit import RateLimits
from bioscara.web.relay import Relay, WebClient
from bioscara.web.scopes import Scope
from bioscara.web.tokens import Tokens

WEBSOCKETS, VIEWERS = 64, 48
"""Largest number of WebSockets at once, and of those above which only operators may connect."""
_ASSETS = read_assets()
PUBLIC = frozenset({*_ASSETS, "/healthz", "/session"})
"""Paths that need no credential: they tell nothing of the arm."""
_BODY_MAX = 1024
"""Longest body of a request [byte]."""
_BODY_TIMEOUT = 5.0
"""Time in which it has to come [s]."""
_RECORDS = 2
"""Flight records that are fetched at once: each may have 16 MiB."""
_LATER = 1013
"""Code with which a WebSocket is closed that may be tried again."""
_QUESTIONS: dict[str, tuple[Callable[[], m.AnyCommand], type[m.Result], str]] = {
    "/api/state": (m.GetState, m.StateSample, "The arm at the end of the last control cycle."),
    "/api/description": (m.GetDescription, m.Description, "Which arm it is."),
    "/api/faults": (m.GetFaults, m.FaultList, "The faults that are not recovered from."),
    "/api/goals": (m.ListGoals, m.GoalList, "The latest goals, oldest first."),
    "/api/statistics": (m.GetStatistics, m.Statistics, "Statistics of the loop and the owner."),
    "/api/flight-records": (m.ListFlightRecords, m.FlightRecordList, "Names of flight records."),
}
"""Paths that ask the owner one question, with its result."""

_log = logging.getLogger(__name__)


class SignIn(msgspec.Struct, forbid_unknown_fields=True):
    """Body of a request to sign in.

    Attributes:
        token: One of the tokens of the gateway.
    """

    token: str


@dataclass(frozen=True, slots=True)
class WebSettings:
    """What the routes need to know.

    Attributes:
        arm: Name of the owner.
        own: Host names and origins of the gateway.
        tokens: The tokens.
        tls: Whether the gateway speaks TLS.
        sessions: The signed-in browsers.
    """

    arm: str
    own: OwnAddresses
    tokens: Tokens
    tls: bool
    sessions: BrowserSessions

    @property
    def cookie(self) -> str:
        """Name of the cookie; gateways on other ports of a host share its cookies."""
        return f"__Host-bioscara-{self.arm}" if self.tls else f"bioscara-{self.arm}"


class _ScopeError(Exception):
    """The credential of a request may not do what a route does."""

    def __init__(self, needed: Scope, has: Scope) -> None:
        self.needed, self.has = needed, has
        super().__init__(needed, has)


def needs(scope: Scope) -> Callable[[HTTPConnection], Credential]:
    """Return the check of a route that needs a scope."""

    def check(connection: HTTPConnection) -> Credential:
        credential = connection.state.credential
        assert isinstance(credential, Credential)  # noqa: S101  the guard let it through
        if credential.scope < scope:
            raise _ScopeError(scope, credential.scope)
        return credential

    return check


Viewer = Annotated[Credential, Depends(needs(Scope.VIEW))]


def guarded(app: FastAPI, settings: WebSettings) -> ASGIApp:
    """Return the routes behind the check of each request."""
    return Guard(
        app,
        settings.own,
        settings.tokens,
        settings.sessions,
        app.state.sign_ins,
        settings.cookie,
        PUBLIC,
    )


def make_app(settings: WebSettings) -> FastAPI:
    """Return the routes of a gateway; they must only be served through :func:`guarded`."""
    queries = OwnerQueries(settings.arm, "web gateway")

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        await queries.close()

    app = FastAPI(
        title="Bioscara",
        version=__version__,
        openapi_url=None,  # its own route, as the built-in one has no check
        docs_url=None,  # FastAPI's pages load programs from other sites
        redoc_url=None,
        lifespan=lifespan,
    )
    app.state.sign_ins = RateLimits(SIGN_INS, SIGN_INS / SIGN_IN_PERIOD)
    app.add_exception_handler(_ScopeError, _refuse_scope)
    app.add_exception_handler(RequestFailedError, _refuse_request)
    app.add_exception_handler(BioscaraError, _refuse_owner)
    _add_page(app, settings)
    _add_session(app, settings)
    _add_questions(app, queries)
    _add_flight_record(app, queries)
    _add_stop(app, settings)
    _add_websocket(app, settings)
    _add_openapi(app)
    return app


def _add_page(app: FastAPI, settings: WebSettings) -> None:
    for path, asset in _ASSETS.items():
        route = _asset_route(asset)
        app.add_api_route(path, route, response_class=Response, include_in_schema=False)

    @app.get("/healthz", response_class=Response, summary="Whether gateway and owner run.")
    def healthz() -> Response:
        try:
            find(settings.arm)
        except OwnerLostError:
            return _json({"gateway": True, "owner": False}, HTTPStatus.SERVICE_UNAVAILABLE)
        return _json({"gateway": True, "owner": True})


def _add_session(app: FastAPI, settings: WebSettings) -> None:
    sessions = settings.sessions
    body = {"application/json": {"schema": {"$ref": "#/components/schemas/SignIn"}}}

    @app.post(
        "/session",
        response_class=Response,
        summary="Sign a browser in: a token for a cookie.",
        openapi_extra={"requestBody": {"required": True, "content": body}},
    )
    async def sign_in(request: Request) -> Response:
        address = request.client.host if request.client else ""
        if not app.state.sign_ins.take(address):
            return _refusal(HTTPStatus.TOO_MANY_REQUESTS, TOO_MANY_SIGN_INS)
        given = await _token_in(request)
        scope = settings.tokens.scope_of(given) if given is not None else None
        if scope is None:
            _log.warning("a sign-in from %s was refused", address)
            return _refusal(HTTPStatus.UNAUTHORIZED, "the token is not one of this gateway")
        response = _json({"scope": scope.name.lower(), "lifetime": LIFETIME})
        response.set_cookie(
            settings.cookie,
            sessions.begin(scope),
            max_age=round(LIFETIME),
            path="/",
            secure=settings.tls,
            httponly=True,
            samesite="strict",
        )
        return response

    @app.get("/session", response_class=Response, summary="What this browser may do.")
    def session(request: Request) -> Response:
        credential = request.state.credential
        return _json({"scope": credential.scope.name.lower() if credential else None})

    @app.delete("/session", response_class=Response, summary="Sign this browser out.")
    async def sign_out(request: Request) -> Response:
        credential = request.state.credential
        if credential is not None and credential.value:
            sessions.end(credential.value)
        response = _json({"scope": None})
        response.delete_cookie(
            settings.cookie, path="/", secure=settings.tls, httponly=True, samesite="strict"
        )
        return response


async def _token_in(request: Request) -> str | None:
    """Return the token in the body of a request; None if there is none."""
    if request.headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        return None
    body = bytearray()
    try:
        async with asyncio.timeout(_BODY_TIMEOUT):
            async for part in request.stream():
                body += part
                if len(body) > _BODY_MAX:
                    return None
    except (TimeoutError, ClientDisconnect):
        return None
    try:
        return msgspec.json.decode(bytes(body), type=SignIn).token
    except (msgspec.DecodeError, UnicodeError, RecursionError):
        return None


def _add_questions(app: FastAPI, queries: OwnerQueries) -> None:
    for path, (command, result, summary) in _QUESTIONS.items():
        app.add_api_route(
            path,
            _question_route(queries, command()),
            summary=summary,
            operation_id=result.__name__,
            response_class=Response,
            responses={200: {"content": _schema(result)}},
        )


def _asset_route(asset: Asset) -> Callable[..., Awaitable[Response]]:
    async def send_asset(request: Request) -> Response:
        headers = {"Vary": "Accept-Encoding"}
        if "gzip" in request.headers.get("accept-encoding", ""):
            headers["Content-Encoding"] = "gzip"
            return Response(asset.compressed, media_type=asset.media_type, headers=headers)
        return Response(asset.content, media_type=asset.media_type, headers=headers)

    return send_asset


def _question_route(
    queries: OwnerQueries, command: m.AnyCommand
) -> Callable[..., Awaitable[Response]]:
    async def ask(_: Viewer) -> Response:
        return Response(await queries.ask(command), media_type="application/json")

    return ask


def _add_flight_record(app: FastAPI, queries: OwnerQueries) -> None:
    turns = asyncio.Semaphore(_RECORDS)

    @app.get(
        "/api/flight-records/{name}",
        response_class=Response,
        summary="A flight record as an MCAP file, by a name of the list.",
        responses={200: {"content": {"application/octet-stream": {}}}},
    )
    async def flight_record(name: str, _: Viewer) -> Response:
        # The owner looks the name up in its list; nowhere is it used as a path.
        async with turns:
            result = await queries.ask(m.GetFlightRecord(name))
        record = msgspec.json.decode(result, type=m.FlightRecordFile)
        disposition = f"attachment; filename*=UTF-8''{quote(record.name, safe='')}"
        return Response(
            record.data,
            media_type="application/octet-stream",
            headers={"Content-Disposition": disposition},
        )


def _add_stop(app: FastAPI, settings: WebSettings) -> None:
    @app.post(
        "/api/stop",
        response_class=Response,
        summary="Stop all motion; whoever may look may stop.",
        responses={200: {"content": _schema(m.Done)}},
    )
    async def stop(credential: Viewer) -> Response:
        # A connection of its own: it waits behind no other request, and says who stopped.
        client = WebClient(credential.scope, credential.address)
        queries = OwnerQueries(settings.arm, client.named("stop"))
        try:
            return Response(await queries.ask(m.StopAll()), media_type="application/json")
        finally:
            await queries.close()


def _add_websocket(app: FastAPI, settings: WebSettings) -> None:
    running: set[Relay] = set()

    @app.websocket("/ws")
    async def websocket(websocket: WebSocket, credential: Viewer) -> None:
        await websocket.accept()
        most = VIEWERS if credential.scope == Scope.VIEW else WEBSOCKETS
        if len(running) >= most:
            await websocket.close(_LATER, f"there are {most} clients; try again later")
            return
        relay = Relay(websocket, settings.arm, WebClient(credential.scope, credential.address))
        running.add(relay)
        session = credential.session
        try:
            if session is None:
                await relay.run(None, None)
            else:
                await relay.run(session.ended, settings.sessions.remaining(session))
        finally:
            running.discard(relay)


def _add_openapi(app: FastAPI) -> None:
    cached: list[bytes] = []

    @app.get("/openapi.json", response_class=Response, include_in_schema=False)
    def openapi(_: Viewer) -> Response:
        if not cached:
            cached.append(msgspec.json.encode(_document(app)))
        return Response(cached[0], media_type="application/json")


def _document(app: FastAPI) -> dict[str, Any]:
    """Return the OpenAPI document, with the messages of the WebSocket among its schemas."""
    template = "#/components/schemas/{name}"
    types = [m.FromClient, m.FromOwner, SignIn, *(result for _, result, _ in _QUESTIONS.values())]
    (sent, received, *_), schemas = msgspec.json.schema_components(types, ref_template=template)
    _, sendable = msgspec.json.schema_components([m.FromClient], ref_template=template)
    # What the owner alone sends may have unknown numbers; from a client they are refused.
    schemas = {
        name: schema if name in sendable else _with_unknown_numbers(schema)
        for name, schema in schemas.items()
    }
    document: dict[str, Any] = dict(app.openapi())
    components = document.setdefault("components", {})
    components.setdefault("schemas", {}).update(schemas, FromClient=sent, FromOwner=received)
    components["securitySchemes"] = {"token": {"type": "http", "scheme": "bearer"}}
    document["security"] = [{"token": []}]
    document["info"]["description"] = (
        "The WebSocket /ws takes FromClient and sends FromOwner, each as a text message."
    )
    return document


def _with_unknown_numbers(schema: Any) -> Any:
    """Return a schema in which a number may be null."""
    match schema:
        case {"type": "number"}:
            return {**schema, "type": ["number", "null"]}
        case dict():
            return {key: _with_unknown_numbers(value) for key, value in schema.items()}
        case list():
            return [_with_unknown_numbers(value) for value in schema]
    return schema


def _schema(result: type[m.Result]) -> dict[str, Any]:
    return {"application/json": {"schema": {"$ref": f"#/components/schemas/{result.__name__}"}}}


def _json(value: object, status: HTTPStatus = HTTPStatus.OK) -> Response:
    return Response(msgspec.json.encode(value), status, media_type="application/json")


def _refusal(status: HTTPStatus, text: str) -> Response:
    return Response(failure_body(text), status, media_type="application/json")


async def _refuse_scope(_: Request, error: Exception) -> Response:
    assert isinstance(error, _ScopeError)  # noqa: S101  as registered
    text = (
        f"this needs the scope {error.needed.name.lower()}, and this client has "
        f"{error.has.name.lower()}; open the page with another token"
    )
    return _refusal(HTTPStatus.FORBIDDEN, text)


async def _refuse_request(_: Request, error: Exception) -> Response:
    assert isinstance(error, RequestFailedError)  # noqa: S101  as registered
    is_unknown = error.failure.code == InvalidArgumentError.code
    status = HTTPStatus.NOT_FOUND if is_unknown else HTTPStatus.CONFLICT
    return _json(error.failure, status)


async def _refuse_owner(_: Request, error: Exception) -> Response:
    return _json(failure_of(error), HTTPStatus.SERVICE_UNAVAILABLE)
