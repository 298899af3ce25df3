"""The web gateway: a state sample from the owner's loop to a WebSocket client."""

from __future__ import annotations

import asyncio
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from websockets.asyncio.client import connect

from benchmarks.measure import Row, at_most, duration

SAMPLES, LENGTH = 1000, 1000
"""Samples that are measured, at 100 Hz; length of an echoed message, as that of a sample [byte]."""
_LIMIT = 2.0
"""Times the round trip of a bare echo: a sample has two sockets to cross and one encoding."""


@contextmanager
def _process(*words: str, **variables: str) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [sys.executable, *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, **variables},
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def _line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline()


async def _arrivals(url: str, token: str) -> dict[int, float]:
    """Return when each sample arrived."""
    found: dict[int, float] = {}
    headers = {"Authorization": f"Bearer {token}"}
    async with connect(f"{url}ws", additional_headers=headers, compression=None) as socket:
        hello = {"kind": "hello", "version": 1, "client": "benchmark", "session": "benchmark"}
        subscribe = {"kind": "subscribe", "states": True}
        await socket.send(json.dumps(hello))
        await socket.send(json.dumps({"kind": "request", "id": 1, "command": subscribe}))
        while len(found) < SAMPLES:
            message = await socket.recv(decode=False)
            now = time.monotonic()
            if message.startswith(b'{"kind":"state"'):
                found[json.loads(message)["cycle"]] = now
    return found


async def _round_trips(port: int, ended: asyncio.Event) -> list[float]:
    """Return the times of round trips at 100 Hz, until ``ended``."""
    found = []
    message = "x" * LENGTH
    async with connect(f"ws://127.0.0.1:{port}/ws", compression=None) as socket:
        while not ended.is_set():
            begin = time.monotonic()
            await socket.send(message)
            await socket.recv()
            found.append(time.monotonic() - begin)
            await asyncio.sleep(0.01)
    return found


async def _measured(url: str, token: str, port: int) -> tuple[dict[int, float], list[float]]:
    ended = asyncio.Event()
    echoing = asyncio.create_task(_round_trips(port, ended))
    arrivals = await _arrivals(url, token)
    ended.set()
    return arrivals, await echoing


def rows() -> list[Row]:
    """Measure samples through the gateway and a bare echo in the same seconds."""
    parts = ("-m", "benchmarks.web_parts")
    with (
        tempfile.TemporaryDirectory(prefix="b") as folder,
        _process(*parts, "arm", "bench", BIOSCARA_RUNTIME=folder) as arm,
        _process(*parts, "echo") as echo,
    ):
        assert _line(arm) == "ready\n"
        words = ("-m", "bioscara", "web", "--arm", "bench", "--port", "0")
        with _process(*words, BIOSCARA_RUNTIME=folder) as gateway:
            found = re.search(r"(http://\S+/)", _line(gateway))
            assert found is not None
            token = json.loads((Path(folder) / "bench.tokens").read_text())["view"]
            url = found[1].replace("http", "ws")
            arrivals, trips = asyncio.run(_measured(url, token, int(_line(echo))))
        assert arm.stdin is not None
        arm.stdin.write("\n")
        arm.stdin.flush()
        stamps = {int(cycle): stamp for cycle, stamp in json.loads(_line(arm)).items()}
    latencies = sorted(
        arrival - stamps[cycle] for cycle, arrival in arrivals.items() if cycle in stamps
    )
    trips.sort()
    note = (
        f"99th percentile {duration(latencies[len(latencies) * 99 // 100])}, of the echo "
        f"{duration(trips[len(trips) * 99 // 100])}"
    )
    return [
        at_most(
            "a state sample at 100 Hz, from the end of its cycle to a WebSocket client",
            statistics.median(latencies),
            _LIMIT,
            statistics.median(trips),
            "round trip of a bare FastAPI WebSocket",
            note,
        )
    ]
