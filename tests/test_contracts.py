"""Each import contract of pyproject.toml fails when it is broken."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LINTER = Path(sys.executable).with_name("lint-imports")


def _broken(folder: Path) -> list[str]:
    """Return the contracts that the copy in ``folder`` breaks."""
    done = subprocess.run(
        [LINTER, "--no-cache"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder / "src"), "NO_COLOR": "1", "COLUMNS": "200"},
        capture_output=True,
        text=True,
        check=False,
    )
    return re.findall(r"^(.+) BROKEN(?: \(\d+ ignored imports\))?$", done.stdout, re.MULTILINE)


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    shutil.copytree(ROOT / "src", tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


BREACHES = [
    ("bus/bus.py", "bioscara.control", "Layers, highest first"),
    ("sim/framing.py", "bioscara.drivers", "The simulator speaks bytes"),
    ("planning/limits.py", "bioscara.clock", "Planning and kinematics are pure"),
    ("kinematics/pose.py", "bioscara.protocol", "Planning and kinematics are pure"),
    (
        "control/loop/loop.py",
        "bioscara.drivers.link.session",
        "Control knows joints through the hardware component only",
    ),
]
"""Module, forbidden import, and the contract that it breaks."""


def test_each_contract_is_broken_once_below() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    contracts = project["tool"]["importlinter"]["contracts"]
    assert {contract["name"] for contract in contracts} == {contract for *_, contract in BREACHES}


@pytest.mark.skipif(not LINTER.is_file(), reason="import-linter is not installed")
@pytest.mark.parametrize(("module", "imported", "contract"), BREACHES)
def test_a_forbidden_import_breaks_its_contract(
    copy: Path, module: str, imported: str, contract: str
) -> None:
    path = copy / "src/bioscara" / module
    path.write_text(f"{path.read_text()}\nimport {imported}\n")
    assert contract in _broken(copy)
