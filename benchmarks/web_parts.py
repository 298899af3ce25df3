"""Processes of the benchmark of the web gateway: an arm that stamps its samples, and an echo."""

from __future__ import annotations

import json
import socket
import sys
import time

import uvicorn
from fastapi import FastAPI, WebSocket, WebSocketDisconnect

from bioscara import Robot
from bioscara.control.loop.loop import CycleReport
from bioscara.server.serve import ServeSettings, serving


def served(name: str) -> None:
    """Serve a simulated arm until a line arrives; then write the time of each cycle's end."""
    stamps: dict[int, float] = {}
    with serving(Robot.simulated(), ServeSettings(name, "sim")) as made:
        runner = made.robot.runner

        def stamp(_: CycleReport) -> None:
            stamps[made.owner.sample.cycle] = time.monotonic()

        # After the owner's own observer, which has just made the sample.
        runner.observers = (*runner.observers, stamp)
        print("ready", flush=True)
        sys.stdin.readline()
        print(json.dumps(stamps), flush=True)


def echo() -> None:
    """Serve a bare WebSocket that returns each message; writes its port first."""
    app = FastAPI()

    @app.websocket("/ws")
    async def websocket(connection: WebSocket) -> None:
        await connection.accept()
        try:
            while True:
                await connection.send_text(await connection.receive_text())
        except WebSocketDisconnect:
            return

    listener = socket.create_server(("127.0.0.1", 0))
    print(listener.getsockname()[1], flush=True)
    config = uvicorn.Config(app, ws="websockets-sansio", log_level="error", loop="asyncio")
    uvicorn.Server(config).run(sockets=[listener])


if __name__ == "__main__":
    if sys.argv[1] == "echo":
        echo()
    else:
        served(sys.argv[2])
