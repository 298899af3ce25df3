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


BREACHES = (
    {
        "Layers, highest first": ("bus/bus.py", "bioscara.control"),
        "Planning and kinematics are pure": ("planning/limits.py", "bioscara.clock"),
    },
    {
        "The simulator speaks bytes": ("sim/framing.py", "bioscara.drivers"),
        "Planning and kinematics are pure": ("kinematics/pose.py", "bioscara.protocol"),
        "Control knows joints through the hardware component only": (
            "control/loop/loop.py",
            "bioscara.drivers.link.session",
        ),
    },
)
"""Contracts, each with a module and an import that breaks it, but none of the others."""


def test_each_contract_is_broken_once_below() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    contracts = project["tool"]["importlinter"]["contracts"]
    assert {each["name"] for each in contracts} == {name for run in BREACHES for name in run}


@pytest.mark.skipif(not LINTER.is_file(), reason="import-linter is not installed")
@pytest.mark.parametrize("breaches", BREACHES)
def test_a_forbidden_import_breaks_its_contract(
    copy: Path, breaches: dict[str, tuple[str, str]]
) -> None:
    for module, imported in breaches.values():
        path = copy / "src/bioscara" / module
        path.write_text(f"{path.read_text()}\nimport {imported}\n")
    broken = _broken(copy)
    assert [contract for contract in breaches if contract not in broken] == []
