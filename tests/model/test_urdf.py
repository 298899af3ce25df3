"""The URDF is what the parameters say now."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from bioscara.model import load_parameters, urdf


def test_the_urdf_is_fresh() -> None:
    assert urdf.URDF.read_text() == urdf.render(load_parameters()), "run make generate"


def test_a_stale_urdf_is_reported_and_then_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(urdf, "URDF", tmp_path / "bioscara.urdf")
    assert urdf.main(["--check"]) == 1
    assert "bioscara.urdf is stale" in capsys.readouterr().err
    assert urdf.main([]) == 0
    assert urdf.main(["--check"]) == 0
    urdf.URDF.write_text(urdf.URDF.read_text().replace("3.04647", "3.1"))
    assert urdf.main(["--check"]) == 1


def _pose(joint: ET.Element, q: float) -> list[list[float]]:
    """Return the 4x4 transform of one URDF joint at ``q``, written out from the standard."""
    origin = joint.find("origin")
    assert origin is not None
    x, y, z = map(float, origin.attrib["xyz"].split())
    r, p, w = map(float, origin.attrib["rpy"].split())
    turn = w
    if joint.attrib["type"] == "prismatic":
        z += q
    elif joint.attrib["type"] == "revolute":
        turn += q
    cr, sr, cp, sp, cw, sw = (
        math.cos(r), math.sin(r), math.cos(p), math.sin(p), math.cos(turn), math.sin(turn),
    )  # fmt: skip
    return [
        [cw * cp, cw * sp * sr - sw * cr, cw * sp * cr + sw * sr, x],
        [sw * cp, sw * sp * sr + cw * cr, sw * sp * cr - cw * sr, y],
        [-sp, cp * sr, cp * cr, z],
        [0.0, 0.0, 0.0, 1.0],
    ]


def test_the_tool_is_where_the_arms_geometry_puts_it() -> None:
    joints = {each.attrib["name"]: each for each in ET.parse(urdf.URDF).iter("joint")
              if "type" in each.attrib}  # fmt: skip
    at = {"j1": 0.3, "j2": 0.2, "j3": -0.7, "j4": 1.1}
    pose = [[float(i == k) for k in range(4)] for i in range(4)]
    for name in ("j1", "j2", "j3", "j4", "flange", "gripper_mount", "tool"):
        step = _pose(joints[name], at.get(name, 0.0))
        pose = [[sum(row[i] * step[i][k] for i in range(4)) for k in range(4)] for row in pose]
    a, b, c = 0.3, 0.3 - 0.7, 0.3 - 0.7 + 1.1
    lengths = 0.329476, 0.285, 0.11908
    x = sum(length * math.cos(angle) for length, angle in zip(lengths, (a, b, c), strict=True))
    y = sum(length * math.sin(angle) for length, angle in zip(lengths, (a, b, c), strict=True))
    assert [row[3] for row in pose[:3]] == pytest.approx([x, y, 0.2 - 0.00909], abs=1e-8)
    assert math.atan2(pose[1][0], pose[0][0]) == pytest.approx(c, abs=1e-8)
    assert pose[2][2] == pytest.approx(1.0, abs=1e-8)


def test_limits_are_those_of_the_parameters() -> None:
    root = ET.parse(urdf.URDF).getroot()
    for joint in load_parameters().joints:
        limit = root.find(f"joint[@name='{joint.name}']/limit")
        assert limit is not None
        assert float(limit.attrib["lower"]) == joint.lower
        assert float(limit.attrib["upper"]) == joint.upper
        assert float(limit.attrib["velocity"]) == joint.max_velocity
