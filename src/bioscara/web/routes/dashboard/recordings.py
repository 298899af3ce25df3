"""The recordings of the arm: list, files, and samples for plots and replay."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator
from http import HTTPStatus
from typing import Annotated, BinaryIO
from urllib.parse import quote

from fastapi import FastAPI, Query, Request, Response
from fastapi.responses import StreamingResponse

from bioscara.dashboard.recordings import (
    FEWEST,
    MOST,
    RecordedSamples,
    RecordingEntry,
    recorded_samples,
    recording_of,
    recordings,
)
from bioscara.files.regular_file import McapFile
from bioscara.rosbag.recording_file import MEDIA_TYPE
from bioscara.web.routes.dashboard.work import Work
from bioscara.web.routes.http import JSON, HttpError, Viewer, answers, json, judged, verdicts
from bioscara.web.settings import WebSettings

_PART = 256 << 10
"""Bytes of a file that are read at once."""
_Count = Annotated[int, Query(ge=FEWEST, le=MOST)]


def add(app: FastAPI, settings: WebSettings, work: Work) -> None:
    """Add the routes."""
    place = settings.recordings, settings.arm

    async def path_of(request: Request, name: str) -> McapFile:
        # Looked up among the names of the folder: nowhere is it used as a path.
        path = await work.do(request, recording_of, *place, name)
        if path is None:
            raise HttpError(HTTPStatus.NOT_FOUND, "there is no recording of this name")
        return path

    @app.get(
        "/api/recordings",
        summary="The recordings of the arm, newest first.",
        responses=answers(RecordingEntry, many=True),
    )
    async def listed(request: Request, _: Viewer) -> Response:
        return json(await work.do(request, recordings, *place))

    @app.get(
        "/api/recordings/{name}",
        summary="A recording as an MCAP file, by a name of the list.",
        responses={200: {"content": {MEDIA_TYPE: {}}}},
    )
    async def file(request: Request, name: str, _: Viewer) -> Response:
        path = await path_of(request, name)
        try:
            opened = await asyncio.to_thread(path.open)
        except OSError:
            raise HttpError(
                HTTPStatus.NOT_FOUND, "the file was deleted, or is no recording"
            ) from None
        size = os.fstat(opened.fileno()).st_size
        return StreamingResponse(
            _parts(opened, size),
            media_type=MEDIA_TYPE,
            headers={
                "Content-Length": str(size),
                "Content-Disposition": f"attachment; filename*=UTF-8''{quote(name, safe='')}",
            },
        )

    @app.get(
        "/api/recordings/{name}/samples",
        summary="Evenly chosen samples of a recording.",
        responses=verdicts(RecordedSamples),
    )
    async def samples(request: Request, name: str, _: Viewer, count: _Count = 2000) -> Response:
        path = await path_of(request, name)
        content = await work.do(request, judged, recorded_samples, path, count)
        return Response(content, media_type=JSON)


async def _parts(file: BinaryIO, size: int) -> AsyncIterator[bytes]:
    """Yield as much of a file as was announced: it may be growing."""
    try:
        while size > 0 and (part := await asyncio.to_thread(file.read, min(size, _PART))):
            size -= len(part)
            yield part
    finally:
        file.close()
