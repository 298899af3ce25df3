"""The libraries that the page carries are those that VENDORED.md lists, and small enough."""

from __future__ import annotations

import gzip
import hashlib
import re
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path

import pytest

VENDOR = Path(str(files("bioscara.dashboard"))) / "page/vendor"
TOOLS = Path(__file__).parents[2] / "tools/dashboard"
BUDGETS = {"three.js": 145e3, "uplot.js": 23.5e3, "uplot.css": 1e3}
"""Largest sizes of the files, compressed by gzip [bytes]."""


def _listed() -> dict[str, str]:
    rows = (VENDOR / "VENDORED.md").read_text().splitlines()
    found = [re.match(r"\| `([\w.]+)` \| .* \| `(\w{64})` \|$", row) for row in rows]
    return {row[1]: row[2] for row in found if row}


def test_each_vendored_file_is_the_listed_one() -> None:
    hashes = {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in VENDOR.iterdir()
        if path.suffix in {".js", ".css"}
    }
    assert hashes == _listed()


def test_the_vendored_files_keep_their_budgets() -> None:
    sizes = {name: len(gzip.compress((VENDOR / name).read_bytes(), 9)) for name in BUDGETS}
    assert {name: size for name, size in sizes.items() if size > BUDGETS[name]} == {}


def test_a_new_bundle_has_the_same_bytes() -> None:
    node = shutil.which("node")
    if node is None or not (TOOLS / "node_modules/esbuild").is_dir():
        pytest.skip("needs node and the packages of tools/dashboard, to make the bundle again")
    done = subprocess.run(
        [node, "bundle.mjs", "--check"], cwd=TOOLS, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
