"""The arm as a browser draws it."""

from __future__ import annotations

import gzip
from collections.abc import Awaitable, Callable
from http import HTTPStatus

from fastapi import FastAPI, Request, Response

from bioscara.dashboard.model import ArmModel, meshes, model_of
from bioscara.model import ArmParameters
from bioscara.web.routes.dashboard.work import Work
from bioscara.web.routes.http import HttpError, Viewer, answers, json


def add(app: FastAPI, parameters: Callable[[], Awaitable[ArmParameters]], work: Work) -> None:
    """Add the routes; the first asks for the parameters of the arm."""
    files = meshes()
    compressed = {name: gzip.compress(content) for name, content in files.items()}

    @app.get(
        "/api/model",
        summary="Links with their meshes, and joints.",
        responses=answers(ArmModel),
    )
    async def model(request: Request, _: Viewer) -> Response:
        return json(await work.do(request, model_of, await parameters()))

    @app.get(
        "/api/meshes/{name}",
        summary="A mesh of the model as binary STL [m].",
        responses={200: {"content": {"model/stl": {}}}},
    )
    async def mesh(name: str, request: Request, _: Viewer) -> Response:
        content = files.get(name)
        if content is None:
            raise HttpError(HTTPStatus.NOT_FOUND, "the model has no such mesh")
        headers = {"Vary": "Accept-Encoding"}
        if "gzip" in request.headers.get("accept-encoding", ""):
            # A seventh of the bytes: coordinates repeat from triangle to triangle.
            headers["Content-Encoding"] = "gzip"
            content = compressed[name]
        return Response(content, media_type="model/stl", headers=headers)
