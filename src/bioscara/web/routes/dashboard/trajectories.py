"""Trajectories from files of a person, read and checked."""

from __future__ import annotations

from fastapi import FastAPI, Request, Response

from bioscara.dashboard.trajectories import SIZE_MAX, CheckedTrajectory, checked_trajectory
from bioscara.web.owner.facts import OwnerFacts
from bioscara.web.owner.queries import OwnerQueries
from bioscara.web.routes.dashboard.arm_now import arm_now
from bioscara.web.routes.dashboard.work import Work
from bioscara.web.routes.http import JSON, Viewer, body_of, judged, verdicts

_TIMEOUT = 30.0
"""Time in which a file has to arrive [s]."""


def add(app: FastAPI, facts: OwnerFacts, queries: OwnerQueries, work: Work) -> None:
    """Add the route."""

    @app.post(
        "/api/trajectories",
        summary="Read a trajectory file, in the body, check its limits, and plan its motion.",
        responses=verdicts(CheckedTrajectory),
        openapi_extra={"requestBody": {"required": True, "content": {"*/*": {}}}},
    )
    async def trajectories(
        request: Request, _: Viewer, name: str = "trajectory.yaml", fit: bool = False
    ) -> Response:
        data = await body_of(request, SIZE_MAX, _TIMEOUT)
        parameters = (await facts.description()).parameters
        workspace, joints = await arm_now(queries)
        content = await work.do(
            request, judged, checked_trajectory, name, data, parameters, workspace, joints, fit=fit
        )
        return Response(content, media_type=JSON)
