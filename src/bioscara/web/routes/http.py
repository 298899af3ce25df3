"""Shared parts of the routes: their scopes, bodies of requests, answers and refusals."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from http import HTTPStatus
from typing import Annotated, Any, ParamSpec, TypeVar

import msgspec
from fastapi import Depends, FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, HTTPConnection

from bioscara.api import framing, messages as m
from bioscara.api.failures import failure_of
from bioscara.errors import BioscaraError, InvalidArgumentError
from bioscara.robot.tasks.scope import Scope
from bioscara.web.access.guard import Credential, failure_body, requester
from bioscara.web.owner.queries import RequestFailedError
from bioscara.web.owner.relay import WebClient

JSON = "application/json"
_BODIES, _OF_VIEWERS, _OF_CLIENT = 4, 2, 2
"""Long bodies that are received at once, of which each may have 8 MiB; of them those of clients
that may only look, and of one client."""

_P = ParamSpec("_P")
_T = TypeVar("_T")


class ContentVerdict(msgspec.Struct, frozen=True):
    """The answer to a question about content: its result, or why it cannot be used.

    That a file or a value cannot be used is an answer and no error of the request: a browser
    reports each error status in its console.

    Attributes:
        result: The result of the content; null if it cannot be used.
        failure: Why it cannot be used, or null.
    """

    result: Any
    failure: m.FailureValue | None


class _BodyError(Exception):
    """The body of a request does not fit its route."""


class HttpError(Exception):
    """A route refuses a request.

    Args:
        status: Status of the answer.
        text: Why, and what to do.
    """

    def __init__(self, status: HTTPStatus, text: str) -> None:
        self.status, self.text = status, text
        super().__init__(status, text)


def needs(scope: Scope) -> Callable[[HTTPConnection], Credential]:
    """Return the check of a route that needs a scope."""

    def check(connection: HTTPConnection) -> Credential:
        credential = connection.state.credential
        assert isinstance(credential, Credential)  # noqa: S101  the guard let it through
        if credential.scope < scope:
            raise HttpError(
                HTTPStatus.FORBIDDEN,
                f"this needs the scope {scope.name.lower()}, and this client has "
                f"{credential.scope.name.lower()}; open the page with another token",
            )
        return credential

    return check


Viewer = Annotated[Credential, Depends(needs(Scope.VIEW))]


def client_of(credential: Credential) -> WebClient:
    """Return the client of a request, as the owner knows it."""
    return WebClient(credential.scope, credential.address, credential.value)


def add_refusals(app: FastAPI) -> None:
    """Let errors of the routes be answered with a failure, as the owner's are."""
    app.add_exception_handler(RequestValidationError, _refuse_values)
    app.add_exception_handler(_BodyError, _refuse_body)
    app.add_exception_handler(HttpError, _refuse)
    app.add_exception_handler(HTTPException, _refuse_route)
    app.add_exception_handler(RequestFailedError, _refuse_request)
    app.add_exception_handler(BioscaraError, _refuse_owner)


def json(value: object, status: HTTPStatus = HTTPStatus.OK) -> Response:
    """Return an answer in JSON; numbers that are not finite become null."""
    return Response(framing.encode_json(value), status, media_type=JSON)


def judged(question: Callable[_P, object], *args: _P.args, **kwargs: _P.kwargs) -> bytes:
    """Return the :class:`ContentVerdict` of a question about content, as JSON."""
    try:
        verdict = ContentVerdict(question(*args, **kwargs), None)
    except BioscaraError as error:
        verdict = ContentVerdict(None, failure_of(error))
    return framing.encode_json(verdict)


def decoded(body: bytes, what: str, kind: type[_T]) -> _T:
    """Return the content of a body in JSON.

    Args:
        body: The body.
        what: Its required form, for messages.
        kind: Its type; other content is answered with status 422.
    """
    try:
        return msgspec.json.decode(body, type=kind)
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise _BodyError(f"{what} cannot be used: {error}") from error


def refusal(status: HTTPStatus, text: str) -> Response:
    """Return an answer that refuses a request."""
    return Response(failure_body(text), status, media_type=JSON)


def schema(result: type[Any]) -> dict[str, Any]:
    """Return the content of an answer, for the OpenAPI document."""
    return {JSON: {"schema": {"$ref": f"#/components/schemas/{result.__name__}"}}}


def answers(result: type[Any], *, many: bool = False) -> dict[int | str, dict[str, Any]]:
    """Return the answers of a route, for the OpenAPI document.

    Args:
        result: Type of the answer.
        many: Whether the answer is a list of them.
    """
    content = schema(result)
    if many:
        content = {JSON: {"schema": {"type": "array", "items": content[JSON]["schema"]}}}
    return {200: {"content": content}}


def verdicts(result: type[Any] | None) -> dict[int | str, dict[str, Any]]:
    """Return the answers of a route with a :class:`ContentVerdict`, for the OpenAPI document.

    Args:
        result: Type of the result; None where it is described elsewhere.
    """

    def nullable(kind: dict[str, Any]) -> dict[str, Any]:
        return {"anyOf": [kind, {"type": "null"}]}

    content = {} if result is None else schema(result)[JSON]["schema"]
    properties = {
        "result": nullable(content),
        "failure": nullable(schema(m.FailureValue)[JSON]["schema"]),
    }
    verdict = {"type": "object", "properties": properties, "required": [*properties]}
    return {200: {"content": {JSON: {"schema": verdict}}}}


class Arriving:
    """The long bodies that are on their way."""

    def __init__(self) -> None:
        self._clients: list[tuple[bool, str]] = []

    def __len__(self) -> int:
        return len(self._clients)

    def begin(self, credential: Credential) -> None:
        """Count a body of a client.

        Raises:
            HttpError: There are too many.
        """
        client = _uploader(credential)
        views, _ = client
        if (
            len(self._clients) >= _BODIES
            or self._clients.count(client) >= _OF_CLIENT
            or (views and sum(views for views, _ in self._clients) >= _OF_VIEWERS)
        ):
            raise HttpError(
                HTTPStatus.SERVICE_UNAVAILABLE,
                f"{len(self._clients)} uploads are on their way; try again later",
            )
        self._clients.append(client)

    def end(self, credential: Credential) -> None:
        """Count a body no more."""
        self._clients.remove(_uploader(credential))


def _uploader(credential: Credential) -> tuple[bool, str]:
    """Return whether a client may only look, and which one it is."""
    return credential.scope == Scope.VIEW, requester(credential, credential.address)


async def body_of(request: Request, longest: int, timeout: float) -> bytes:
    """Return the body of a request.

    Args:
        request: The request.
        longest: Longest body that is accepted [byte].
        timeout: Time in which it has to come [s].

    Raises:
        HttpError: It is longer, or slower, or too many others are on their way.
    """
    arriving: Arriving = request.app.state.arriving
    credential: Credential = request.state.credential
    arriving.begin(credential)
    try:
        return await received(request, longest, timeout)
    finally:
        arriving.end(credential)


async def received(request: Request, longest: int, timeout: float) -> bytes:
    """Return a short body of a request: as :func:`body_of`, however many are on their way."""
    too_long = HttpError(
        HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
        f"the body has more than {longest / 2**20:g} MiB; split it",
    )
    announced = request.headers.get("content-length", "0")
    if not announced.isascii() or not announced.isdigit() or int(announced[:16]) > longest:
        raise too_long
    body = bytearray()
    try:
        async with asyncio.timeout(timeout):
            async for part in request.stream():
                body += part
                if len(body) > longest:
                    raise too_long
    except (TimeoutError, ClientDisconnect):
        raise HttpError(
            HTTPStatus.REQUEST_TIMEOUT, f"the body took longer than {timeout:g} s to arrive"
        ) from None
    return bytes(body)


async def _refuse_values(_: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)  # noqa: S101  as registered
    texts = [f"{each['loc'][-1]}: {each['msg']}" for each in error.errors()]
    return _unusable("; ".join(texts))


async def _refuse_body(_: Request, error: Exception) -> Response:
    return _unusable(str(error))


def _unusable(text: str) -> Response:
    failure = failure_of(InvalidArgumentError(text))
    return json(failure, HTTPStatus.UNPROCESSABLE_ENTITY)


async def _refuse(_: Request, error: Exception) -> Response:
    assert isinstance(error, HttpError)  # noqa: S101  as registered
    return refusal(error.status, error.text)


async def _refuse_route(_: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)  # noqa: S101  as registered
    text = f"{error.detail}; /openapi.json lists what the gateway answers"
    answer = refusal(HTTPStatus(error.status_code), text)
    # With status 405, Allow has the methods that the path takes.
    answer.headers.update(error.headers or {})
    return answer


async def _refuse_request(_: Request, error: Exception) -> Response:
    assert isinstance(error, RequestFailedError)  # noqa: S101  as registered
    is_unknown = error.failure.code == InvalidArgumentError.code
    status = HTTPStatus.NOT_FOUND if is_unknown else HTTPStatus.CONFLICT
    return json(error.failure, status)


async def _refuse_owner(_: Request, error: Exception) -> Response:
    return json(failure_of(error), HTTPStatus.SERVICE_UNAVAILABLE)
