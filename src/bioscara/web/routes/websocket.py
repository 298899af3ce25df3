"""The WebSocket, which a relay joins to the owner."""

from __future__ import annotations

from fastapi import FastAPI, WebSocket

from bioscara.robot.tasks.scope import Scope
from bioscara.web.owner.relay import Relay, WebClient
from bioscara.web.routes.http import Viewer
from bioscara.web.settings import WebSettings

WEBSOCKETS, VIEWERS = 64, 48
"""Largest number of WebSockets at once, and of those above which only operators may connect."""
_LATER = 1013
"""Code with which a WebSocket is closed that may be tried again."""


def add(app: FastAPI, settings: WebSettings) -> None:
    """Add the route."""
    running: set[Relay] = set()

    @app.websocket("/ws")
    async def websocket(websocket: WebSocket, credential: Viewer) -> None:
        await websocket.accept()
        most = VIEWERS if credential.scope == Scope.VIEW else WEBSOCKETS
        if len(running) >= most:
            await websocket.close(_LATER, f"there are {most} clients; try again later")
            return
        relay = Relay(websocket, settings.arm, WebClient(credential.scope, credential.address))
        running.add(relay)
        session = credential.session
        try:
            if session is None:
                await relay.run(None, None)
            else:
                await relay.run(session.ended, settings.sessions.remaining(session))
        finally:
            running.discard(relay)
