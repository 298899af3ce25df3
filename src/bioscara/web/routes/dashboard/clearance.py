"""The clearance of the arm now."""

from __future__ import annotations

from fastapi import FastAPI, Request, Response

from bioscara.dashboard.clearance import Clearance, clearance
from bioscara.web.owner.facts import OwnerFacts
from bioscara.web.owner.queries import OwnerQueries
from bioscara.web.routes.dashboard.arm_now import joints_now
from bioscara.web.routes.dashboard.work import Work
from bioscara.web.routes.http import Viewer, answers, json


def add(app: FastAPI, facts: OwnerFacts, queries: OwnerQueries, work: Work) -> None:
    """Add the route."""

    @app.get(
        "/api/clearance",
        summary="The nearest pair of bodies, at the end of the last control cycle.",
        responses=answers(Clearance),
    )
    async def nearest(request: Request, _: Viewer) -> Response:
        description, workspace = await facts.description(), await facts.workspace()
        joints = await joints_now(queries)
        return json(await work.do(request, clearance, description.parameters, workspace, joints))
