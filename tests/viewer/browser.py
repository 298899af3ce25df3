"""A browser that shows the page, as the server sees it."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest
import viser

from bioscara.viewer.page import Page


class Browser:
    """A message from a browser's page to the server."""

    def __init__(self, page: Page) -> None:
        self._msgspec = pytest.importorskip("msgspec.msgpack")
        client = pytest.importorskip("websockets.sync.client")
        self._socket = client.connect(
            page.url.replace("http", "ws"),
            subprotocols=[f"viser-v{viser.__version__}"],
            max_size=None,
        )
        # A page counts once it has reported the position of its camera.
        self.say(
            type="ViewerCameraMessage", wxyz=[1, 0, 0, 0], position=[1, 1, 1], fov=1.0, near=0.1,
            far=9.0, image_height=100, image_width=100, look_at=[0, 0, 0], up_direction=[0, 0, 1],
        )  # fmt: skip

    def say(self, **message: object) -> None:
        self._socket.send(self._msgspec.encode(message))

    def close(self) -> None:
        self._socket.close()


def wait(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)
