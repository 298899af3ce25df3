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

    async def answered(function: Callable[..., object], *arguments: Any) -> Response:
        return Response(await work.do(judged, function, *arguments), media_type=JSON)

    async def values_in(request: Request) -> object:
        return decoded(await body_of(request, BODY_MAX, _TIMEOUT), "the sequence", object)

    @app.post(
        "/api/sequences/read",
        summary="Read a sequence of steps, a YAML file in the body.",
        responses=verdicts(None),
        openapi_extra=_BODY,
    )
    async def read_file(request: Request, _: Viewer, name: str = "sequence.yaml") -> Response:
        return await answered(read, name, await body_of(request, BODY_MAX, _TIMEOUT))

    @app.post(
        "/api/sequences/write",
        summary="Write a sequence, as JSON in the body, as YAML.",
        responses=verdicts(SequenceText),
        openapi_extra=_BODY,
    )
    async def write(request: Request, _: Viewer) -> Response:
        return await answered(written, await values_in(request))

    @app.post(
        "/api/sequences/script",
        summary="Write a sequence, as JSON in the body, or steps of it, as a Python program.",
        responses=verdicts(SequenceText),
        openapi_extra=_BODY,
    )
    async def script(
        request: Request, _: Viewer, first: _Index = 0, last: _Index | None = None
    ) -> Response:
        return await answered(scripted, await values_in(request), first, last)

    @app.post(
        "/api/sequences/plan",
        summary="Plan a sequence, as JSON in the body, from where the arm is; nothing moves.",
        responses=verdicts(DryRun),
        openapi_extra=_BODY,
    )
    async def plan(
        request: Request, _: Viewer, first: _Index = 0, last: _Index | None = None
    ) -> Response:
        values = await values_in(request)
        workspace, joints = await arm_now(queries)
        parameters = (await facts.description()).parameters
        return await answered(dry_run_of, values, parameters, workspace, joints, first, last)
