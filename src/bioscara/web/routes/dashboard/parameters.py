"""The parameters of the arm, and drafts of its overlay."""

from __future__ import annotations

import msgspec
from fastapi import FastAPI, Request, Response

from bioscara.api import messages as m
from bioscara.dashboard.parameters import (
    ParameterChanges,
    ParameterDraft,
    ParameterTable,
    drafted,
    parameter_rows,
)
from bioscara.web.owner.queries import OwnerQueries
from bioscara.web.routes.dashboard.work import Work
from bioscara.web.routes.http import (
    JSON,
    Viewer,
    answers,
    body_of,
    decoded,
    json,
    judged,
    schema,
    verdicts,
)

_BODY_MAX = 256 << 10
"""Longest list of changes [byte]."""
_TIMEOUT = 10.0
"""Time in which it has to arrive [s]."""


def add(app: FastAPI, queries: OwnerQueries, work: Work) -> None:
    """Add the routes."""

    async def present() -> m.ParametersState:
        return msgspec.json.decode(await queries.ask(m.GetParameters()), type=m.ParametersState)

    @app.get(
        "/api/parameters",
        summary="The parameters of the arm, with its overlay.",
        responses=answers(ParameterTable),
    )
    async def parameters(request: Request, _: Viewer) -> Response:
        return json(await work.do(request, _table, await present()))

    @app.post(
        "/api/parameters/check",
        summary="The overlay with changes, checked and not written.",
        responses=verdicts(ParameterDraft),
        openapi_extra={"requestBody": {"required": True, "content": schema(ParameterChanges)}},
    )
    async def check(request: Request, _: Viewer) -> Response:
        body = await body_of(request, _BODY_MAX, _TIMEOUT)
        changes = decoded(body, "the changes", ParameterChanges)
        content = await work.do(request, judged, _draft, await present(), changes)
        return Response(content, media_type=JSON)


def _table(state: m.ParametersState) -> ParameterTable:
    rows = parameter_rows(state.overlay)
    return ParameterTable(state.revision, state.restart, state.overlay, rows)


def _draft(state: m.ParametersState, changes: ParameterChanges) -> ParameterDraft:
    overlay, diff = drafted(state.overlay, changes.changes)
    return ParameterDraft(overlay, state.revision, diff)
