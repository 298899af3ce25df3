"""Fixtures: the packages in a prefix of links, an arm and the node."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from pathlib import Path

import pytest

from ros.rig import Rig, Ros, rig
from ros.share import make_prefix
from served import HALF

collect_ignore = ["executor_program.py", "launch_arguments.py", "ros_client.py"]
"""Programs for the Python with the wheels of ROS."""


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a prefix with the packages."""
    return make_prefix(tmp_path_factory.mktemp("prefix"))


@pytest.fixture(autouse=True, scope="module")
def packages_are_found(prefix: Path) -> Iterator[None]:
    """Let xacro find the packages, by ament_index_python."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AMENT_PREFIX_PATH", str(prefix))
        yield


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
