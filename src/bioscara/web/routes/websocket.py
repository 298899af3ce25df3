"""The WebSocket, which a relay joins to the owner."""

from __future__ import annotations

from collections import deque

from fastapi import FastAPI, WebSocket

from bioscara.robot.tasks.scope import Scope
from bioscara.web.owner.relay import Relay
from bioscara.web.routes.http import Viewer, client_of
from bioscara.web.settings import WebSettings

WEBSOCKETS, VIEWERS = 64, 48
"""Largest number of WebSockets at once, and of those above which only operators may connect."""
RESERVED = 16
"""Further ones that may send nothing but a STOP; the oldest is closed for the newest."""


def add(app: FastAPI, settings: WebSettings) -> None:
    """Add the route."""
    running: set[Relay] = set()
    reserved: deque[Relay] = deque()

    @app.websocket("/ws")
    async def websocket(websocket: WebSocket, credential: Viewer) -> None:
        await websocket.accept()
        most = VIEWERS if credential.scope == Scope.VIEW else WEBSOCKETS
        full = len(running) >= most or not websocket.state.has_place
        relay = Relay(
            websocket,
            settings.arm,
            client_of(credential),
            f"there are {most} clients; try again later" if full else "",
        )
        if not full:
            running.add(relay)
        else:
            reserved.append(relay)
            if len(reserved) > RESERVED:
                reserved[0].end()
        try:
            await relay.run(settings.sessions, credential.session)
        finally:
            running.discard(relay)
            if relay in reserved:
                reserved.remove(relay)
