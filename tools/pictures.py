"""Make the pictures of the documentation: ``python -m tools.pictures``.

Needs the extras ``plot`` and ``web``, Playwright, and Chromium for those of pages.
All pictures of the dashboard, with each tab and state at three sizes, land in ``runs/pictures``;
``python -m tools.pictures dashboard`` makes these alone.
"""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any
from urllib.request import urlopen

from PIL import Image
from websockets.sync.client import ClientConnection, connect

from bioscara.cli import main
from tools.page_pictures import make_page_pictures

IMAGES = Path(__file__).parents[1] / "docs/images"
PAGES = Path(__file__).parents[1] / "runs/pictures"
POSE = ("0.45", "-0.2", "0.25", "0")
SCENE = """\
version: 1
table_height: 0.0
margin: 0.005
zones:
  - name: plate reader
    keep: out
    shape: box
    lower: [0.0, 0.38, 0.0]
    upper: [0.26, 0.6, 0.22]
    yaw: 0.2
"""
VIEW_PORT, BROWSER_PORT = 18097, 18098
PATIENCE = 30.0
"""Longest time that view and browser take to start [s]."""
DRAWING = 20.0
"""Time in which the page is drawn without a graphics processor [s]."""


def make_plots(folder: Path) -> None:
    """Write ``plan.png`` and ``demo.png``."""
    main(["plan", "--name", "center", "--plot", str(folder / "plan.png")])
    main(["demo", "--out", str(folder / "demo")], paced=False)
    shutil.copy(folder / "plan.png", IMAGES)
    shutil.copy(folder / "demo/plot.png", IMAGES / "demo.png")


def make_view(folder: Path) -> None:
    """Write ``view.png``, the page of ``bioscara view`` with a plan."""
    scene = folder / "scene.yaml"
    scene.write_text(SCENE)
    words = ["view", "--pose", *POSE, "--scene", str(scene), "--port", str(VIEW_PORT)]
    view = subprocess.Popen([sys.executable, "-m", "bioscara", *words])  # noqa: S603  our own
    try:
        _wait(f"http://127.0.0.1:{VIEW_PORT}")
        _photograph(folder, IMAGES / "view.png")
    finally:
        view.terminate()
        view.wait()


def _photograph(folder: Path, path: Path) -> None:
    program = shutil.which("chromium")
    if program is None:
        raise SystemExit("the picture of the view needs Chromium: apt install chromium")
    options = [
        "--headless=new",
        "--no-sandbox",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--window-size=1400,900",
        f"--remote-debugging-port={BROWSER_PORT}",
        f"--user-data-dir={folder / 'profile'}",
    ]
    browser = subprocess.Popen(  # noqa: S603  the options above
        [program, *options, f"http://127.0.0.1:{VIEW_PORT}"], stderr=subprocess.DEVNULL
    )
    try:
        pages = json.loads(_wait(f"http://127.0.0.1:{BROWSER_PORT}/json/list"))
        (page,) = [page for page in pages if page["type"] == "page"]
        time.sleep(DRAWING)
        with connect(page["webSocketDebuggerUrl"], max_size=None) as connection:
            hide = "document.querySelectorAll('.mantine-Notification-closeButton')"
            _call(connection, "Runtime.evaluate", expression=f"{hide}.forEach(b => b.click())")
            time.sleep(2.0)
            shown = _call(connection, "Page.captureScreenshot")
        raw = folder / "view.png"
        raw.write_bytes(base64.b64decode(shown["data"]))
        Image.open(raw).convert("RGB").quantize(256).save(path, optimize=True)
    finally:
        browser.terminate()
        browser.wait()


def _call(connection: ClientConnection, method: str, **parameters: object) -> Any:
    connection.send(json.dumps({"id": 1, "method": method, "params": parameters}))
    while (answer := json.loads(connection.recv(timeout=PATIENCE))).get("id") != 1:
        pass
    return answer["result"]


def _wait(address: str) -> bytes:
    end = time.monotonic() + PATIENCE
    while True:
        try:
            with urlopen(address) as answer:  # noqa: S310  of this computer
                return bytes(answer.read())
        except OSError:
            if time.monotonic() > end:
                raise
            time.sleep(0.5)


if __name__ == "__main__":
    IMAGES.mkdir(exist_ok=True)
    make_page_pictures(PAGES, IMAGES)
    if sys.argv[1:] == ["dashboard"]:
        raise SystemExit
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        make_plots(Path(name))
        make_view(Path(name))
