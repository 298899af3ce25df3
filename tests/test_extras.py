"""Every command of installation that is shown to a user works."""

from __future__ import annotations

import re
import shlex
import sys
import tomllib
from pathlib import Path
from typing import get_args

from bioscara.extras import Extra, install

ROOT = Path(__file__).parents[1]


def test_extras_exist_and_are_installed_for_the_python_that_runs() -> None:
    known = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    for extra in get_args(Extra):
        assert extra in known
        words = shlex.split(install(extra))
        assert words == [sys.executable, "-m", "pip", "install", f"bioscara[{extra}]"]


def test_no_message_has_a_command_of_its_own() -> None:
    for path in (ROOT / "src").rglob("*.py"):
        found = re.search(r"pip install", path.read_text())
        assert found is None, path
