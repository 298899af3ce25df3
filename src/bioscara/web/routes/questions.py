"""Questions to the owner, its flight records, and STOP, by HTTP."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Annotated
from urllib.parse import quote

import msgspec
from fastapi import FastAPI, Header, Response

from bioscara.api import messages as m
from bioscara.web.owner.joined_calls import JoinedCalls
from bioscara.web.owner.queries import OwnerQueries
from bioscara.web.owner.relay import WebClient
from bioscara.web.owner.served_arms import CYCLE
from bioscara.web.routes.http import JSON, Viewer, client_of, json, schema
from bioscara.web.settings import WebSettings

QUESTIONS: dict[str, tuple[Callable[[], m.AnyCommand], type[m.Result], str]] = {
    "/api/state": (m.GetState, m.StateSample, "The arm at the end of the last control cycle."),
    "/api/description": (m.GetDescription, m.Description, "Which arm it is."),
    "/api/faults": (m.GetFaults, m.FaultList, "The faults that are not recovered from."),
    "/api/goals": (m.ListGoals, m.GoalList, "The latest goals, oldest first."),
    "/api/statistics": (m.GetStatistics, m.Statistics, "Statistics of the loop and the owner."),
    "/api/flight-records": (m.ListFlightRecords, m.FlightRecordList, "Names of flight records."),
}
"""Paths that ask the owner one question, with its result."""

_RECORDS = 2
"""Flight records that are fetched at once: each may have 16 MiB."""


def add(app: FastAPI, settings: WebSettings, queries: OwnerQueries) -> None:
    """Add the routes."""
    _add_questions(app, queries)
    _add_flight_record(app, queries)
    _add_stop(app, settings)


def _add_questions(app: FastAPI, queries: OwnerQueries) -> None:
    for path, (command, result, summary) in QUESTIONS.items():
        app.add_api_route(
            path,
            _question_route(queries, command()),
            summary=summary,
            operation_id=result.__name__,
            responses={200: {"content": schema(result)}},
        )


def _question_route(
    queries: OwnerQueries, command: m.AnyCommand
) -> Callable[..., Awaitable[Response]]:
    async def ask(_: Viewer) -> Response:
        return Response(await queries.ask(command), media_type=JSON)

    return ask


def _add_flight_record(app: FastAPI, queries: OwnerQueries) -> None:
    turns = asyncio.Semaphore(_RECORDS)

    @app.get(
        "/api/flight-records/{name}",
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
    async def pass_on(client: WebClient, sessions: set[str]) -> None:
        # A connection of its own: it waits behind no other request, and has the client's name. In
        # the session of the same client's WebSocket it leaves the lease, and is no further event.
        session = sessions.pop() if len(sessions) == 1 else ""
        queries = OwnerQueries(settings.arm, client.named("stop"), session)
        try:
            await queries.stop()
        finally:
            await queries.close()

    stops = JoinedCalls(CYCLE, pass_on)

    @app.post(
        "/api/stop",
        summary="Stop all motion; a token that may look is enough.",
        responses={200: {"content": schema(m.Done)}},
    )
    async def stop(credential: Viewer, bioscara_session: Annotated[str, Header()] = "") -> Response:
        client, session = client_of(credential), bioscara_session
        named = client.session(session) if 0 < len(session) <= m.NAME_MAX else ""
        await stops.do(client, named)
        return json(m.Done())
