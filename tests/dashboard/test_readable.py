"""Errors of the arm as the page shows them: each quantity in mm or degrees, none half of it."""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from bioscara import Box, JointVelocity, Pose
from bioscara.errors import BioscaraError, UnreachableError
from bioscara.model.loading import load_parameters
from served import HALF, own_robot
from simulated import simulated_bus

NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="needs node, to run a module of the page")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\d.]*\d)")
RATIOS = (1.0, 1e3, 180.0 / math.pi)


def readable(texts: Sequence[str]) -> list[str]:
    """Return the texts as the page shows them."""
    module = files("bioscara.dashboard").joinpath("page/js/format.js")
    program = f"""import {{ readable }} from {json.dumps(f"file://{module}")};
    console.log(JSON.stringify({json.dumps(texts)}.map(readable)));"""
    assert NODE is not None
    words = [NODE, "--input-type=module", "-e", program]
    shown: list[str] = json.loads(
        subprocess.run(words, capture_output=True, text=True, check=True).stdout
    )
    return shown


def said(call: Callable[[], Any]) -> str:
    """Return the text of the error that a call raises."""
    with pytest.raises(BioscaraError) as caught:
        call()
    return str(caught.value)


def provoked(evidence: Path) -> list[str]:
    """Return the texts of errors with quantities, of kinematics, planner, limits and parameters."""
    arm = simulated_bus(seed=2, homed=True, at=HALF).arm
    overlay = evidence / "arm.yaml"
    overlay.write_text("joints: {j2: {lower: 2.0}}\n")
    poses = [
        *(Pose(x, y, z, yaw) for x in (-0.6, -0.13, 0.05, 0.5) for y in (-0.05, 0.3)
          for z in (0.2, 0.9) for yaw in (0.0, 2.0)),
        Pose(2.0, 0.0, 0.2, math.pi / 2),
    ]  # fmt: skip
    texts = []
    with own_robot(evidence, arm=arm) as robot:
        for pose in poses:
            with suppress(UnreachableError):
                robot.kinematics.solve(pose, HALF)
                continue
            texts.append(said(lambda pose=pose: robot.kinematics.solve(pose, HALF)))  # type: ignore[misc]
        assert any(" or j" in text for text in texts)
        here = robot.pose
        return [
            *texts,
            said(lambda: robot.move_joints((9.0, 0.1, 0.0, 0.0))),
            said(lambda: robot.move_joints((0.0, 0.9, 0.0, 0.0))),
            said(lambda: robot.move_to(Pose(500.0, 0.0, 0.2))),
            said(lambda: robot.move_linear(here)),
            said(lambda: robot.move_relative(yaw=4.0)),
            said(lambda: robot.gripper.move(0.5)),
            said(lambda: robot.jog(lambda: JointVelocity(j1=9.0))),
            said(lambda: Box("rack", (0.4, 0.0, 0.0), (0.5, 0.1, -0.1))),
            said(lambda: load_parameters(overlay=overlay)),
        ]


def test_errors_are_shown_in_mm_and_degrees(tmp_path: Path) -> None:
    texts = provoked(tmp_path)
    for text, shown in zip(texts, readable(texts), strict=True):
        assert not re.search(r"\d\)? (?:m|rad)\b(?! or)", shown), (text, shown)
        given, left = ([float(each) for each in NUMBER.findall(one)] for one in (text, shown))
        assert len(given) == len(left) or "already" in shown, (text, shown)
        for before, after in zip(given, left, strict=False):
            near = (math.isclose(after, before * each, rel_tol=1e-4) for each in RATIOS)
            assert any(near), (text, shown)
