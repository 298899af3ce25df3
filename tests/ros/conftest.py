"""Fixtures: the packages in a prefix of links, and a stand-in for ROS."""

from __future__ import annotations

from pathlib import Path

import pytest

from ros import launch_stand_in
from ros.share import make_prefix


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a prefix with the packages."""
    return make_prefix(tmp_path_factory.mktemp("prefix"))


@pytest.fixture(autouse=True)
def stand_in(monkeypatch: pytest.MonkeyPatch, prefix: Path) -> None:
    """Let launch files and xacro find the packages."""
    launch_stand_in.install(monkeypatch, prefix)
