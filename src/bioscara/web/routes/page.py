"""The files of the page, and whether gateway and owner run."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from http import HTTPStatus

from fastapi import FastAPI, Request, Response

from bioscara.api.runtime import find
from bioscara.dashboard.assets import Asset, read_assets
from bioscara.errors import OwnerLostError
from bioscara.web.routes.http import json

VERSION, ASSETS = read_assets()
"""Version of the files of the page, and the files: a page of another version is out of date."""


def add_files(app: FastAPI) -> None:
    """Add the routes of the files, which need no credential: they reveal nothing of the arm."""
    for path, asset in ASSETS.items():
        route = _asset_route(asset)
        app.add_api_route(path, route, include_in_schema=False)


def add(app: FastAPI, arm: str) -> None:
    """Add the routes, none of which needs a credential."""
    add_files(app)

    @app.get("/healthz", summary="Whether gateway and owner run.")
    def healthz() -> Response:
        try:
            find(arm)
        except OwnerLostError:
            return json({"gateway": True, "owner": False}, HTTPStatus.SERVICE_UNAVAILABLE)
        return json({"gateway": True, "owner": True})


def _asset_route(asset: Asset) -> Callable[..., Awaitable[Response]]:
    tag = f'W/"{asset.tag}"'  # weak: the compressed content is not the same bytes

    async def send_asset(request: Request) -> Response:
        # Kept by the browser, which asks each time whether it is still the same.
        headers = {"Vary": "Accept-Encoding", "ETag": tag, "Cache-Control": "no-cache"}
        if tag in request.headers.get("if-none-match", ""):
            return Response(status_code=HTTPStatus.NOT_MODIFIED, headers=headers)
        if "gzip" in request.headers.get("accept-encoding", ""):
            headers["Content-Encoding"] = "gzip"
            return Response(asset.compressed, media_type=asset.media_type, headers=headers)
        return Response(asset.content, media_type=asset.media_type, headers=headers)

    return send_asset
