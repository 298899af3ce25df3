"""Fixtures: the packages in a prefix of links, and a stand-in for ROS."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from pathlib import Path

import pytest

from ros import launch_stand_in
from ros.rig import Rig, Ros, rig
from ros.share import make_prefix
from served import HALF

collect_ignore = ["executor_program.py", "ros_client.py"]
"""Programs for the Python with the wheels of ROS."""


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a prefix with the packages."""
    return make_prefix(tmp_path_factory.mktemp("prefix"))


@pytest.fixture(autouse=True)
def stand_in(monkeypatch: pytest.MonkeyPatch, prefix: Path) -> None:
    """Let launch files and xacro find the packages."""
    launch_stand_in.install(monkeypatch, prefix)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Function,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Show the end of the node's log with a failure: it has the reason of a refusal."""
    report = yield
    if report.failed and isinstance(node := item.funcargs.get("ros_rig"), Rig):
        report.sections.append(("end of node.log", node.log[-3000:]))
    return report


# The processes end with the last test of this folder: idle, they take a quarter of a core.
@pytest.fixture(scope="package")
def ros_rig() -> Iterator[Rig]:
    """Return the rig, in which processes are started."""
    with rig() as made:
        yield made


@pytest.fixture(scope="package")
def ros(ros_rig: Rig) -> Iterator[Ros]:
    """Return clients of a node of a homed arm; the owner and the node run."""
    with ros_rig.owner(*HALF), ros_rig.node(), ros_rig.clients() as clients:
        yield clients
