"""Make the pictures of the documentation: ``python -m tools.pictures``; needs matplotlib."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from bioscara.cli import main

IMAGES = Path(__file__).parents[1] / "docs/images"


def make() -> None:
    """Write ``plan.png`` and ``demo.png`` into ``docs/images``."""
    IMAGES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        main(["plan", "--name", "center", "--plot", str(folder / "plan.png")])
        main(["demo", "--out", str(folder / "demo")], paced=False)
        shutil.copy(folder / "plan.png", IMAGES)
        shutil.copy(folder / "demo/plot.png", IMAGES / "demo.png")


if __name__ == "__main__":
    make()
