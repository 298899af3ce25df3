"""Make the pictures of the documentation: ``python -m tools.pictures``.

Needs the extras ``plot`` and ``web``, Playwright, and Chromium for those of pages.
All pictures of the dashboard, with each tab and state at three sizes, and of the page of
``bioscara view`` land in ``runs/pictures``; ``python -m tools.pictures dashboard`` makes these
alone.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from bioscara.cli import main
from tools.page_pictures import SCHEMES, SIZES, make_page_pictures

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
DRAWING = 3000
"""Time in which the page is drawn without a graphics processor [ms]."""


def make_plots(folder: Path) -> None:
    """Write ``plan.png`` and ``demo.png``."""
    main(["plan", "--name", "center", "--plot", str(folder / "plan.png")])
    main(["demo", "--out", str(folder / "demo")], paced=False)
    shutil.copy(folder / "plan.png", IMAGES)
    shutil.copy(folder / "demo/plot.png", IMAGES / "demo.png")


def make_view(folder: Path) -> None:
    """Write the page of ``bioscara view`` with a plan, at each size; one is ``view.png``."""
    scene = folder / "scene.yaml"
    scene.write_text(SCENE)
    words = ["view", "--pose", *POSE, "--scene", str(scene), "--port", "0"]
    with (
        subprocess.Popen(
            [sys.executable, "-m", "bioscara", *words], stdout=subprocess.PIPE, text=True
        ) as view,
        sync_playwright() as playwright,
    ):
        assert view.stdout is not None
        address = view.stdout.readline().partition(": ")[2].partition(" ")[0]
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"))
        for size, (width, height) in SIZES.items():
            for scheme in SCHEMES:
                page = browser.new_page(
                    viewport={"width": width, "height": height}, color_scheme=scheme
                )
                page.goto(address)
                page.wait_for_timeout(DRAWING)
                page.evaluate("bioscara.seekPreview(1.7)")
                page.wait_for_timeout(DRAWING)
                page.screenshot(path=PAGES / f"view-plan-{size}-{scheme}.png")
                page.close()
        browser.close()
        view.terminate()
    with Image.open(PAGES / "view-plan-desktop-light.png") as picture:
        picture.convert("RGB").quantize(256).save(IMAGES / "view.png", optimize=True)


if __name__ == "__main__":
    IMAGES.mkdir(exist_ok=True)
    make_page_pictures(PAGES, IMAGES)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        make_view(Path(name))
        if sys.argv[1:] != ["dashboard"]:
            make_plots(Path(name))
