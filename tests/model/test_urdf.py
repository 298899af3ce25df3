"""The URDF matches the present parameters."""

from __future__ import annotations

import importlib.util
import math
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from tools import description

from bioscara.errors import ConfigurationError
from bioscara.model import load_parameters, urdf

FRESH = pytest.mark.skipif(
    importlib.util.find_spec("xacro") is None, reason="pip install xacro pyyaml: the generator"
)


@FRESH
def test_the_description_is_fresh() -> None:
    assert description.write(urdf.DESCRIPTION, check=True) == [], "run make generate"


@FRESH
def test_stale_files_are_reported_and_then_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "model" / "description"
    shutil.copytree(urdf.DESCRIPTION, folder)
    parameters = folder.parent / "parameters.yaml"
    shutil.copy(urdf.DESCRIPTION.parent / "parameters.yaml", parameters)
    monkeypatch.setattr(description, "DESCRIPTION", folder)
    assert description.main(["--check"]) == 0
    parameters.write_text(parameters.read_text().replace("3.04647", "3.1"))
    mesh = folder / "meshes/visual/link_1_metal.stl"
    mesh.write_bytes(b"")
    (folder / "meshes/visual/link_9_metal.stl").write_bytes(b"")
    assert description.main(["--check"]) == 1
    complaint = capsys.readouterr().err
    for name in ("bioscara.urdf", "link_1_metal.stl", "link_9_metal.stl"):
        assert name in complaint
    assert description.main([]) == 0
    assert description.main(["--check"]) == 0
    assert 'upper="3.1"' in (folder / "bioscara.urdf").read_text()
    shipped = urdf.URDF.parent / "meshes/visual/link_1_metal.stl"
    assert mesh.read_bytes() == shipped.read_bytes()


@FRESH
def test_the_arguments_of_the_description_do_what_they_say() -> None:
    source = urdf.DESCRIPTION / "bioscara.urdf.xacro"
    root = ET.fromstring(
        description.render(
            source, prefix="left_", parent="bench", xyz="0.1 0 0.2", gripper="false",
            hardware="mock", meshes="file:///meshes",
        )
    )  # fmt: skip
    links = {link.attrib["name"] for link in root.findall("link")}
    arm = ("base_link", "link_1", "link_2", "link_3", "link_4", "tool_flange")
    assert links == {"bench", *(f"left_{name}" for name in arm)}
    base = root.find("joint[@name='left_base']/origin")
    assert base is not None
    assert base.attrib["xyz"] == "0.1 0 0.2"
    assert [tag.attrib["name"] for tag in root.findall("ros2_control")] == ["left_bioscara_arm"]
    plugins = {plugin.text for plugin in root.iter("plugin")}
    assert plugins == {"mock_components/GenericSystem"}
    assert all(mesh.attrib["filename"].startswith("file:///meshes/") for mesh in root.iter("mesh"))


@FRESH
def test_an_unknown_kind_of_hardware_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="hardware is fake but must be real or mock"):
        description.render(urdf.DESCRIPTION / "bioscara.urdf.xacro", hardware="fake")


@FRESH
@pytest.mark.parametrize("argument", ["xyz", "rpy"])
@pytest.mark.parametrize("value", ["0 0", "0 0 0 0", "", "0 0 up", "0 nan 0"])
def test_a_position_that_is_not_three_numbers_is_refused(argument: str, value: str) -> None:
    told = f"{argument} is '{value}' but must be three num"
    told = "could not convert string to float: 'up'" if "up" in value else told
    with pytest.raises(ConfigurationError, match=told):
        description.render(urdf.DESCRIPTION / "bioscara.urdf.xacro", **{argument: value})


@FRESH
@pytest.mark.parametrize("gripper", ["true", "false"])
def test_srdf_and_urdf_name_the_same_links_and_joints(gripper: str) -> None:
    arguments = {"prefix": "left_", "gripper": gripper}
    arm, groups = (
        ET.fromstring(description.render(urdf.DESCRIPTION / f"bioscara.{kind}.xacro", **arguments))
        for kind in ("urdf", "srdf")
    )
    links = {each.attrib["name"] for each in arm.findall("link")}
    joints = {each.attrib["name"] for each in arm.findall("joint")}
    named = {
        (key, value)
        for tag in groups.iter()
        for key, value in tag.attrib.items()
        if key in {"link1", "link2", "base_link", "tip_link", "parent_link"}
    }
    assert {value for _, value in named} <= links
    assert {each.attrib["name"] for each in groups.iter("joint")} <= joints
    assert {each.attrib["name"] for each in groups.iter("passive_joint")} <= joints
    bodies = {
        each.attrib["name"] for each in arm.findall("link") if each.find("collision") is not None
    }
    names = {value for key, value in named if key in {"link1", "link2"}}
    assert names == bodies
    defined = {each.attrib["name"] for each in groups.findall("group")}
    assert defined == {"left_arm"} | ({"left_gripper"} if gripper == "true" else set())
    for tag in (*groups.findall("group_state"), *groups.findall("end_effector")):
        assert tag.attrib["group"] in defined


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
