"""The files of the page, and whether gateway and owner run."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from http import HTTPStatus

from fastapi import FastAPI, Request, Response

from bioscara.api.runtime import find
from bioscara.dashboard.assets import Asset, read_assets, version_of
from bioscara.errors import OwnerLostError
from bioscara.web.routes.http import json

ASSETS = read_assets()
VERSION = version_of(ASSETS)
"""Version of the files of the page: a page of another one has to be loaded again."""


def add(app: FastAPI, arm: str) -> None:
    """Add the routes, which need no credential: they tell nothing of the arm."""
    for path, asset in ASSETS.items():
        route = _asset_route(asset)
        app.add_api_route(path, route, response_class=Response, include_in_schema=False)

    @app.get("/healthz", response_class=Response, summary="Whether gateway and owner run.")
    def healthz() -> Response:
        try:
            find(arm)
        except OwnerLostError:
            return json({"gateway": True, "owner": False}, HTTPStatus.SERVICE_UNAVAILABLE)
        return json({"gateway": True, "owner": True})


def _asset_route(asset: Asset) -> Callable[..., Awaitable[Response]]:
    async def send_asset(request: Request) -> Response:
        headers = {"Vary": "Accept-Encoding"}
        if "gzip" in request.headers.get("accept-encoding", ""):
            headers["Content-Encoding"] = "gzip"
            return Response(asset.compressed, media_type=asset.media_type, headers=headers)
        return Response(asset.content, media_type=asset.media_type, headers=headers)

    return send_asset
