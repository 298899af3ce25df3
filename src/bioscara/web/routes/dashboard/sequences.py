"""Sequences of steps: read, written, planned."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from fastapi import FastAPI, Query, Request, Response

from bioscara.dashboard.sequences import (
    BODY_MAX,
    DryRun,
    SequenceText,
    dry_run_of,
    read,
    scripted,
    written,
)
from bioscara.web.owner.facts import OwnerFacts
from bioscara.web.owner.queries import OwnerQueries
from bioscara.web.routes.dashboard.arm_now import arm_now
from bioscara.web.routes.dashboard.work import Work
from bioscara.web.routes.http import JSON, Viewer, body_of, decoded, judged, verdicts

_TIMEOUT = 30.0
"""Time in which a body has to arrive [s]."""
_Index = Annotated[int, Query(ge=0)]
_BODY: dict[str, Any] = {"requestBody": {"required": True, "content": {"*/*": {}}}}


def add(app: FastAPI, facts: OwnerFacts, queries: OwnerQueries, work: Work) -> None:
    """Add the routes."""

    async def answered(
        request: Request, function: Callable[..., object], *arguments: Any
    ) -> Response:
        body = await body_of(request, BODY_MAX, _TIMEOUT)
        content = await work.do(request, _judged_of_json, function, body, *arguments)
        return Response(content, media_type=JSON)

    @app.post(
        "/api/sequences/read",
        summary="Read a sequence of steps, a YAML file in the body.",
        responses=verdicts(None),
        openapi_extra=_BODY,
    )
    async def read_file(request: Request, _: Viewer, name: str = "sequence.yaml") -> Response:
        body = await body_of(request, BODY_MAX, _TIMEOUT)
        content = await work.do(request, judged, read, name, body)
        return Response(content, media_type=JSON)

    @app.post(
        "/api/sequences/write",
        summary="Write a sequence, as JSON in the body, as YAML.",
        responses=verdicts(SequenceText),
        openapi_extra=_BODY,
    )
    async def write(request: Request, _: Viewer) -> Response:
        return await answered(request, written)

    @app.post(
        "/api/sequences/script",
        summary="Write a sequence, as JSON in the body, or steps of it, as a Python program.",
        responses=verdicts(SequenceText),
        openapi_extra=_BODY,
    )
    async def script(
        request: Request, _: Viewer, first: _Index = 0, last: _Index | None = None
    ) -> Response:
        return await answered(request, scripted, first, last)

    @app.post(
        "/api/sequences/plan",
        summary="Plan a sequence, as JSON in the body, from where the arm is; nothing moves.",
        responses=verdicts(DryRun),
        openapi_extra=_BODY,
    )
    async def plan(
        request: Request, _: Viewer, first: _Index = 0, last: _Index | None = None
    ) -> Response:
        workspace, joints = await arm_now(queries)
        parameters = (await facts.description()).parameters
        return await answered(request, dry_run_of, parameters, workspace, joints, first, last)


def _judged_of_json(function: Callable[..., object], body: bytes, *arguments: Any) -> bytes:
    """Return the verdict of a function on the content of a body in JSON, and on more."""
    return judged(function, decoded(body, "the sequence", object), *arguments)
