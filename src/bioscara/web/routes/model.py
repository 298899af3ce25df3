"""The arm as a browser draws it."""

from __future__ import annotations

from http import HTTPStatus

from fastapi import FastAPI, Response

from bioscara.dashboard.model import ArmModel, meshes, model_of
from bioscara.web.owner_facts import OwnerFacts
from bioscara.web.routes.http import RefusedError, Viewer, answers, json
from bioscara.web.routes.work import Work


def add(app: FastAPI, facts: OwnerFacts, work: Work) -> None:
    """Add the routes."""
    files = meshes()

    @app.get(
        "/api/model",
        response_class=Response,
        summary="Links with their meshes, and joints.",
        responses=answers(ArmModel),
    )
    async def model(_: Viewer) -> Response:
        description = await facts.description()
        return json(await work.do(model_of, description.parameters))

    @app.get(
        "/api/meshes/{name}",
        response_class=Response,
        summary="A mesh of the model as binary STL [m].",
        responses={200: {"content": {"model/stl": {}}}},
    )
    async def mesh(name: str, _: Viewer) -> Response:
        content = files.get(name)
        if content is None:
            raise RefusedError(HTTPStatus.NOT_FOUND, "the model has no such mesh")
        return Response(content, media_type="model/stl")
