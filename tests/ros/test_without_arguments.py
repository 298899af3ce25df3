"""The node without arguments of ROS, and the example that moves an arm through it."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

from bioscara.api.runtime import VARIABLE
from bioscara.remote.remote_robot import RemoteRobot
from bioscara.ros import owner_process
from ros.rig import CONFIGS, ROOT, rig
from served import HALF, NAME

EXAMPLE = ROOT / "examples" / "ros2" / "first_motion.py"
GOAL = (0.3, 0.2, 0.8, -0.5)
"""Where the example ends."""


def merged(parts: list[dict[str, Any]]) -> dict[str, Any]:
    """Return parameter files as one, as the node reads them one after the other."""
    whole: dict[str, Any] = {}
    for part in parts:
        for node, content in part.items():
            known = whole.setdefault(node, {"ros__parameters": {}})
            known["ros__parameters"].update(content["ros__parameters"])
    return whole


def test_the_parameters_are_those_of_the_launch_files() -> None:
    own = Path(owner_process.__file__).with_name("bringup.yaml")
    assert yaml.safe_load(own.read_text()) == merged(
        [yaml.safe_load(path.read_text()) for path in CONFIGS]
    )


@pytest.mark.ros
def test_the_example_moves_the_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    elsewhere = (0.6, *HALF[1:])
    with (
        rig(4) as site,
        site.owner(*elsewhere, speed=5.0),
        site.node("--arm", NAME, description="", configs=()),
    ):
        run = subprocess.run(
            [site.python, EXAMPLE],
            check=False,
            env=site.environment,
            capture_output=True,
            text=True,
            timeout=100,
        )
        assert run.returncode == 0, run.stderr + site.log
        assert "there" in run.stderr
        monkeypatch.setenv(VARIABLE, str(site.folder))
        with RemoteRobot(NAME) as robot:
            assert robot.state.positions == pytest.approx(GOAL, abs=5e-3)
