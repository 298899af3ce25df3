"""All arms of this computer: how they are, and STOP."""

from __future__ import annotations

from http import HTTPStatus

from fastapi import FastAPI, Response

from bioscara.errors import OwnerLostError
from bioscara.web.owner.served_arms import ServedArm, ServedArms, StoppedArm
from bioscara.web.routes.http import HttpError, Viewer, answers, client_of, json


def add(app: FastAPI, served: ServedArms) -> None:
    """Add the routes."""

    @app.get(
        "/api/arms",
        summary="The arms that are served on this computer.",
        responses=answers(ServedArm, many=True),
    )
    async def arms(_: Viewer) -> Response:
        return json(await served.look())

    @app.post(
        "/api/arms/stop",
        summary="Stop all arms of this computer; a token that may look at one is enough.",
        responses=answers(StoppedArm, many=True),
    )
    async def stop_all(credential: Viewer) -> Response:
        client = client_of(credential)
        return json(await served.stop_all(client))

    @app.post(
        "/api/arms/{name}/stop",
        summary="Stop an arm of this computer.",
        responses=answers(StoppedArm, many=True),
    )
    async def stop(name: str, credential: Viewer) -> Response:
        client = client_of(credential)
        try:
            stopped = await served.stop(name, client)
        except OwnerLostError as error:
            raise HttpError(HTTPStatus.NOT_FOUND, str(error)) from error
        return json([stopped])
