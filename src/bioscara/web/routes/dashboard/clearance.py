"""The clearance of the arm now."""

from __future__ import annotations

import msgspec
from fastapi import FastAPI, Response

from bioscara.api import messages as m
from bioscara.dashboard.clearance import Clearance, clearance
from bioscara.web.owner.facts import OwnerFacts
from bioscara.web.owner.queries import OwnerQueries
from bioscara.web.routes.dashboard.work import Work
from bioscara.web.routes.http import Viewer, answers, json


class _Sample(msgspec.Struct):
    """The part of a :class:`~bioscara.api.messages.StateSample` that is needed here."""

    positions: tuple[float | None, ...]
    pose: object


def add(app: FastAPI, facts: OwnerFacts, queries: OwnerQueries, work: Work) -> None:
    """Add the route."""

    @app.get(
        "/api/clearance",
        response_class=Response,
        summary="The nearest pair of bodies, at the end of the last control cycle.",
        responses=answers(Clearance),
    )
    async def nearest(_: Viewer) -> Response:
        description, workspace = await facts.description(), await facts.workspace()
        sample = msgspec.json.decode(await queries.ask(m.GetState()), type=_Sample)
        # Without a pose a joint is not homed, and its position is an assumption.
        joints = () if sample.pose is None else sample.positions
        return json(await work.do(clearance, description.parameters, workspace, joints))
