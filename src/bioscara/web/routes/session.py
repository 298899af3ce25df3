"""Signing browsers in and out."""

from __future__ import annotations

import logging
from http import HTTPStatus

import msgspec
from fastapi import FastAPI, Request, Response

from bioscara.web.access.browser_sessions import LIFETIME
from bioscara.web.access.guard import TOO_MANY_SIGN_INS
from bioscara.web.routes.http import JSON, HttpError, json, received, refusal
from bioscara.web.routes.page import VERSION
from bioscara.web.settings import WebSettings

_BODY_MAX = 1024
"""Longest body of a request [byte]."""
_BODY_TIMEOUT = 5.0
"""Time in which it has to come [s]."""

_log = logging.getLogger(__name__)


class SignIn(msgspec.Struct, forbid_unknown_fields=True):
    """Body of a request to sign in.

    Attributes:
        token: One of the tokens of the gateway.
    """

    token: str


def add(app: FastAPI, settings: WebSettings) -> None:
    """Add the routes."""
    sessions = settings.sessions
    body = {JSON: {"schema": {"$ref": "#/components/schemas/SignIn"}}}

    @app.post(
        "/session",
        summary="Sign a browser in: a token for a cookie.",
        openapi_extra={"requestBody": {"required": True, "content": body}},
    )
    async def sign_in(request: Request) -> Response:
        address = request.client.host if request.client else ""
        given = await _token_in(request)
        scope = settings.tokens.scope_of(given) if given is not None else None
        if scope is None:
            # The right one is never refused: others may share the address of a client that guesses.
            if not app.state.sign_ins.take(address):
                return refusal(HTTPStatus.TOO_MANY_REQUESTS, TOO_MANY_SIGN_INS)
            _log.warning("a sign-in from %s was refused", address)
            return refusal(HTTPStatus.UNAUTHORIZED, "the token is not one of this gateway")
        former = request.state.credential
        if former is not None and former.value:
            sessions.end(former.value)
        response = json({"scope": scope.name.lower(), "lifetime": LIFETIME})
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

    @app.get(
        "/session",
        summary="What this browser may do, and the version of the page's files.",
    )
    def session(request: Request) -> Response:
        credential = request.state.credential
        scope = credential.scope.name.lower() if credential else None
        return json({"scope": scope, "assets": VERSION})

    @app.delete("/session", summary="Sign this browser out.")
    async def sign_out(request: Request) -> Response:
        credential = request.state.credential
        if credential is not None and credential.value:
            sessions.end(credential.value)
        response = json({"scope": None})
        response.delete_cookie(
            settings.cookie, path="/", secure=settings.tls, httponly=True, samesite="strict"
        )
        return response


async def _token_in(request: Request) -> str | None:
    """Return the token in the body of a request; None if there is none."""
    if request.headers.get("content-type", "").partition(";")[0].strip() != JSON:
        return None
    try:
        body = await received(request, _BODY_MAX, _BODY_TIMEOUT)
    except HttpError:
        return None
    try:
        return msgspec.json.decode(body, type=SignIn).token
    except (msgspec.DecodeError, UnicodeError, RecursionError):
        return None
