"""The parameters of the arm, and drafts of its overlay."""

from __future__ import annotations

from collections.abc import Callable

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
from bioscara.errors import BioscaraError, InvalidArgumentError
from bioscara.web.owner.queries import OwnerQueries
from bioscara.web.routes.dashboard.work import Work
from bioscara.web.routes.http import Viewer, answers, body_of, json, schema, unusable

_BODY_MAX = 256 << 10
"""Longest list of changes [byte]."""
_TIMEOUT = 10.0
"""Time in which it has to arrive [s]."""


def add(app: FastAPI, queries: OwnerQueries, work: Work) -> None:
    """Add the routes."""

    async def answered(compute: Callable[[m.ParametersState], object]) -> Response:
        answer = await queries.ask(m.GetParameters())
        state = msgspec.json.decode(answer, type=m.ParametersState)
        try:
            return json(await work.do(compute, state))
        except BioscaraError as error:
            return unusable(error)

    @app.get(
        "/api/parameters",
        response_class=Response,
        summary="The parameters of the arm, with its overlay.",
        responses=answers(ParameterTable),
    )
    async def parameters(_: Viewer) -> Response:
        def table(state: m.ParametersState) -> ParameterTable:
            rows = parameter_rows(state.overlay)
            return ParameterTable(state.revision, state.restart, state.overlay, rows)

        return await answered(table)

    @app.post(
        "/api/parameters/check",
        response_class=Response,
        summary="The overlay with changes, checked and not written.",
        responses=answers(ParameterDraft),
        openapi_extra={"requestBody": {"required": True, "content": schema(ParameterChanges)}},
    )
    async def check(request: Request, _: Viewer) -> Response:
        body = await body_of(request, _BODY_MAX, _TIMEOUT)
        try:
            changed = msgspec.json.decode(body, type=ParameterChanges).changes
        except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
            return unusable(InvalidArgumentError(f"the changes cannot be used: {error}"))

        def draft(state: m.ParametersState) -> ParameterDraft:
            overlay, diff = drafted(state.overlay, changed)
            return ParameterDraft(overlay, state.revision, diff)

        return await answered(draft)
