"""Connections that keep a gateway busy: with a moving arm a STOP arrives, and logs are short."""

from __future__ import annotations

import resource
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest

from bioscara.api import messages as m
from hostile.moving_arm import LATENCY, MovingArm, moving_arm
from served import RawClient

FILES = 1024
"""Files that the gateway may have open."""


@contextmanager
def connections(arm: MovingArm, count: int, begin: bytes = b"") -> Iterator[list[socket.socket]]:
    """Open connections, send the begin of a request on each, and nothing more."""
    with ExitStack() as stack:
        opened = []
        for _ in range(count):
            opened.append(stack.enter_context(socket.create_connection(arm.address, timeout=20.0)))
            with suppress(OSError):  # ended for a newer one
                opened[-1].sendall(begin)
        yield opened


def test_a_stop_arrives_through_each_door_beside_silent_connections(tmp_path: Path) -> None:
    with moving_arm(tmp_path) as arm, RawClient("stopper", path=arm.socket) as client:
        with connections(arm, 300):
            assert arm.stop(arm.post_stop) < LATENCY
        assert arm.stop(lambda: client.request(m.StopAll())) < LATENCY


@pytest.mark.thorough
def test_connections_of_the_same_address_and_token_hinder_no_stop(tmp_path: Path) -> None:
    with moving_arm(tmp_path) as arm:
        head = f"GET /api/state HTTP/1.1\r\nHost: {arm.origin[7:]}\r\n"
        token = arm.bearer("view")["Authorization"]
        for begin in (head, f"{head}Authorization: {token}\r\n\r\n{head}"):
            with connections(arm, 300, begin.encode()):
                assert arm.stop(arm.post_stop) < LATENCY
                assert arm.stop(lambda: arm.post_stop("operate")) < LATENCY


@pytest.mark.thorough
def test_more_connections_than_files_hinder_no_stop(tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 4096), hard))
    try:
        with moving_arm(tmp_path) as arm:
            assert arm.gateway is not None
            resource.prlimit(arm.gateway.pid, resource.RLIMIT_NOFILE, (FILES, FILES))
            with connections(arm, 1400):
                for _ in range(3):
                    assert arm.stop(arm.post_stop) < LATENCY
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
