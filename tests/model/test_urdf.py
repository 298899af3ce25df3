"""The URDF matches the present parameters."""

from __future__ import annotations

import importlib.util
import math
import shutil
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest
from ruamel.yaml import YAML
from tools import description

from bioscara.errors import ConfigurationError
from bioscara.model import ArmParameters, load_parameters, urdf

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
    base = root.find("joint[@name='left_base_joint']/origin")
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
    of_gripper = {"left_gripper", "left_arm_gripper"} if gripper == "true" else set()
    assert defined == {"left_arm"} | of_gripper
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
    for name in ("j1", "j2", "j3", "j4", "flange_joint", "grp_base_joint", "tool"):
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


def other_arm(folder: Path, share: float) -> tuple[Path, ArmParameters]:
    """Return a complete file with every value that the description follows changed, and its arm."""
    whole = YAML(typ="rt").load((urdf.DESCRIPTION.parent / "parameters.yaml").read_text())
    for joint in whole["joints"].values():
        for key in ("reduction", "lower", "upper", "max_velocity", "max_acceleration"):
            joint[key] *= share
        joint["drive_current_percent"] += 7
        joint["hold_current_percent"] += 6
        joint["stall_threshold"] += 5
        joint["homing"] = {
            "velocity": joint["homing"]["velocity"] * share * share,
            "threshold": joint["homing"]["threshold"] + 4,
            "current_percent": joint["homing"]["current_percent"] + 3,
            "acceleration": joint["homing"]["acceleration"] * share,
        }
    for key in ("height", "tool_x", "tool_z"):
        whole["geometry"][key] *= share
    whole["geometry"]["tool_y"] = share - 1.0
    jaws = whole["gripper"]
    jaws |= {"lower": 0.045, "upper": 0.1, "max_velocity": share, "initial": 0.07}
    jaws |= {"deg_per_m": jaws["deg_per_m"] / share, "zero_width": 0.06}
    file = folder / "arm.yaml"
    with file.open("w") as stream:
        YAML(typ="rt").dump(whole, stream)
    return file, load_parameters(file)


def numeric(text: str) -> list[object]:
    """Return tags, attributes and texts of a document; numbers as numbers."""

    def value(word: str) -> object:
        try:
            return pytest.approx(float(word), rel=1e-12, abs=1e-15)
        except ValueError:
            return word

    return [
        (tag.tag, name, [value(word) for word in given.split()])
        for tag in ET.fromstring(text).iter()
        for name, given in sorted({**tag.attrib, "": tag.text or ""}.items())
    ]


@FRESH
@pytest.mark.parametrize("share", [0.97, 0.91])
def test_the_description_of_another_arm_is_what_xacro_makes_of_its_values(
    tmp_path: Path, share: float
) -> None:
    file, parameters = other_arm(tmp_path, share)
    expanded = description.render(urdf.DESCRIPTION / "bioscara.urdf.xacro", parameters=str(file))
    found = urdf.urdf_of(parameters)
    assert numeric(found) == numeric(expanded)
    assert numeric(found) != numeric(urdf.URDF.read_text())
    same_height = replace(parameters.geometry, height=load_parameters().geometry.height)
    expanded = description.render(urdf.DESCRIPTION / "bioscara.srdf.xacro", parameters=str(file))
    found = urdf.srdf_of(replace(parameters, geometry=same_height))
    assert numeric(found) == numeric(expanded)
    assert numeric(found) != numeric(urdf.SRDF.read_text())


def test_states_beyond_the_reach_of_the_jaws_are_left_out() -> None:
    parameters = load_parameters()
    jaws = replace(parameters.gripper, lower=0.05, upper=0.07, initial=0.06)
    narrow = replace(parameters, gripper=jaws)
    states = ET.fromstring(urdf.srdf_of(narrow)).findall("group_state")
    assert {state.attrib["name"] for state in states} == {"center", "open", "close"}


def test_the_description_of_the_existing_arms_is_the_shipped_one() -> None:
    parameters = load_parameters()
    assert ET.canonicalize(urdf.urdf_of(parameters)) == ET.canonicalize(urdf.URDF.read_text())
    assert ET.canonicalize(urdf.srdf_of(parameters)) == ET.canonicalize(urdf.SRDF.read_text())


@pytest.mark.parametrize("name", ["upper_arm", "forearm", "tool_mass"])
def test_other_meshes_or_masses_need_a_rebuilt_description(name: str) -> None:
    parameters = load_parameters()
    other = replace(parameters, geometry=replace(parameters.geometry, **{name: 0.3}))
    for make in (urdf.urdf_of, urdf.srdf_of):
        with pytest.raises(ConfigurationError, match=rf"geometry\.{name}: 0\.3 .* make generate"):
            make(other)


def test_pairs_are_freed_only_in_the_ranges_that_were_checked() -> None:
    parameters = load_parameters()
    elbow = replace(parameters.joints[2], upper=2.7)
    wide = replace(parameters, joints=(*parameters.joints[:2], elbow, parameters.joints[3]))
    with pytest.raises(ConfigurationError, match=r"joints\.j3: .* is wider than .* narrow"):
        urdf.srdf_of(wide)
    high = replace(parameters, geometry=replace(parameters.geometry, height=0.15))
    with pytest.raises(ConfigurationError, match=r"geometry\.height: 0\.15 is not the 0\.135"):
        urdf.srdf_of(high)
