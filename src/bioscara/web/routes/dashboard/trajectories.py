"""Trajectories from files of a person, read and checked."""

from __future__ import annotations

from fastapi import FastAPI, Request, Response

from bioscara.dashboard.trajectories import SIZE_MAX, CheckedTrajectory, checked_trajectory
from bioscara.web.owner.facts import OwnerFacts
from bioscara.web.routes.dashboard.work import Work
from bioscara.web.routes.http import JSON, Viewer, body_of, judged, verdicts

_TIMEOUT = 30.0
"""Time in which a file has to arrive [s]."""


def add(app: FastAPI, facts: OwnerFacts, work: Work) -> None:
    """Add the route."""

    @app.post(
        "/api/trajectories",
        response_class=Response,
        summary="Read a trajectory file, in the body, and compare it with the limits of the arm.",
        responses=verdicts(CheckedTrajectory),
        openapi_extra={"requestBody": {"required": True, "content": {"*/*": {}}}},
    )
    async def trajectories(
        request: Request, _: Viewer, name: str = "trajectory.yaml", fit: bool = False
    ) -> Response:
        data = await body_of(request, SIZE_MAX, _TIMEOUT)
        description = await facts.description()
        parameters = description.parameters
        content = await work.do(judged, checked_trajectory, name, data, parameters, fit=fit)
        return Response(content, media_type=JSON)
