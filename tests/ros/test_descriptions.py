"""The descriptions: the same arm as the model's, for every value of their arguments."""

from __future__ import annotations

import itertools
import math
import re
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest
from tools import ros_packages

from bioscara.model import load_parameters
from bioscara.model.urdf import URDF, urdf_of
from bioscara.ros.arm.description import RobotDescription
from ros.share import GRIPPER, NAMES, PACKAGES, expand, scene

MESH = re.compile(r"package://(\w+)/(.+)")
ENTRIES = {
    "bioscara_arm_description": "bioscara",
    "bioscara_gripper_descriptions": "bioscara_gripper_128",
    "scene_descriptions": "scene",
}
"""Name of the robot of each scene.xacro."""
UNPREFIXED = ("world", "table", "table_joint")
"""Names of the surroundings, which are not those of the arm."""


def entry(prefix: Path, package: str) -> Path:
    return prefix / "share" / package / "urdf/scene.xacro"


def parts(root: ET.Element) -> dict[tuple[str, str], Any]:
    """Return the parts of a description by kind and name, without the packages of meshes."""

    def value(text: str) -> Any:
        text = MESH.sub(r"\2", text.strip())
        try:
            return [float(word) for word in text.split()]
        except ValueError:
            return text

    def content(part: ET.Element) -> Any:
        attributes = {name: value(text) for name, text in part.attrib.items()}
        return part.tag, attributes, value(part.text or ""), [content(each) for each in part]

    return {(part.tag, part.attrib["name"]): content(part) for part in root}


def test_the_scene_has_the_links_joints_limits_masses_and_tags_of_the_model(prefix: Path) -> None:
    assert parts(scene(prefix, table="false")) == parts(ET.parse(URDF).getroot())


def test_the_scene_has_a_table_below_the_arm_unless_told_otherwise(prefix: Path) -> None:
    with_table, without = (parts(scene(prefix, table=each)) for each in ("true", "false"))
    assert with_table == parts(scene(prefix))
    added = {name: with_table.pop(name) for name in with_table.keys() - without.keys()}
    assert with_table == without
    assert added.keys() == {("link", "table"), ("joint", "table_joint")}
    table = next(link for link in scene(prefix).iter("link") if link.attrib["name"] == "table")
    box, origin = (next(table.iter(name)).attrib for name in ("box", "origin"))
    size = [float(word) for word in box["size"].split()]
    # The base stands on its top.
    assert float(origin["xyz"].split()[2]) == pytest.approx(-size[2] / 2.0)
    assert size[:2] == [1.0, 2.0]


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_only_the_jaws_reach_the_table_and_only_below_twelve_millimetres(
    prefix: Path, tmp_path: Path
) -> None:
    """The tool, a few millimetres higher than the fingers' ends, is below its top at 9 mm."""
    pin = pytest.importorskip("pinocchio", reason="pip install pin: the independent loader")
    path = tmp_path / "scene.urdf"
    path.write_text(ET.tostring(scene(prefix), encoding="unicode"))
    model = pin.buildModelFromUrdf(str(path))
    shapes = pin.buildGeomFromUrdf(
        model, str(path), pin.GeometryType.COLLISION, package_dirs=[str(prefix / "share")]
    )
    bodies = shapes.geometryObjects
    links = [model.frames[body.parentFrame].name for body in bodies]
    for number in range(len(bodies)):
        if links[number] not in ("table", "base_link"):
            shapes.addCollisionPair(pin.CollisionPair(links.index("table"), number))
    data, found, q = model.createData(), shapes.createData(), pin.neutral(model)
    height, column = (model.joints[model.getJointId(name)].idx_q for name in ("j2", "j1"))
    # Stretched out along the longer side of the table.
    q[column] = math.pi / 2.0
    for lift, expected in (
        (-0.0016, {"left_jaw_link", "right_jaw_link"}),
        (0.0115, {"left_jaw_link", "right_jaw_link"}),
        (0.0117, set()),
        (0.338, set()),
    ):
        q[height] = lift
        pin.computeCollisions(model, data, shapes, found, q, False)
        touched = {
            links[pair.second]
            for pair, result in zip(shapes.collisionPairs, found.collisionResults, strict=True)
            if result.isCollision()
        }
        assert touched == expected
    q[height] = 0.009
    pin.framesForwardKinematics(model, data, q)
    assert -2e-4 < data.oMf[model.getFrameId("tool", pin.FrameType.BODY)].translation[2] < 0.0


def test_another_arm_has_the_description_that_the_model_gives_it(
    prefix: Path, tmp_path: Path
) -> None:
    """Values that follow from a parameter of a joint or the gripper follow here, too."""
    overlay = tmp_path / "overlay.yaml"
    overlay.write_text(
        "joints: {j1: {upper: 2.9, drive_current_percent: 30}, j3: {reduction: 25.0,"
        " max_velocity: 4.0, homing: {threshold: 20}}}\ngripper: {upper: 0.1, zero_width: 0.057}\n"
    )
    shutil.copytree(prefix, tmp_path / "prefix")
    (tmp_path / "prefix").rename(tmp_path / "other")
    other = load_parameters(overlay=overlay)
    generated = ros_packages.files(other)
    for package, config in (
        ("bioscara_arm_description", "bioscara_arm_parameters.yaml"),
        ("bioscara_gripper_descriptions", "bioscara_gripper_128_parameters.yaml"),
    ):
        folder = tmp_path / "other/share" / package / "config"
        shutil.rmtree(folder)
        folder.mkdir()
        (folder / config).write_bytes(generated[f"{package}/config/{config}"])
    found = {}
    for package in ("bioscara_arm_description", "bioscara_gripper_descriptions"):
        found |= parts(expand(entry(tmp_path / "other", package)))
    wanted = parts(ET.fromstring(urdf_of(other)))
    for root in (found, wanted):
        # Where the gripper is mounted differs: here on the world.
        del root["joint", "base_joint"], root["joint", "grp_base_joint"]
    assert found == wanted


def test_all_entries_expand_for_all_arguments(prefix: Path) -> None:
    for package, robot in ENTRIES.items():
        source = entry(prefix, package)
        declared = re.findall(r'<xacro:arg name="(\w+)"', source.read_text())
        grippers = ("", "bioscara_gripper_descriptions")
        for mock, before, gripper in itertools.product(("true", "false"), ("", "left_"), grippers):
            given = {"use_mock_hardware": mock, "prefix": before} | (
                {"gripper_description_package": gripper} if package == "scene_descriptions" else {}
            )
            assert set(given) <= set(declared)
            root = expand(source, **{name: text for name, text in given.items() if text})
            assert root.attrib["name"] == robot
            links = {link.attrib["name"] for link in root.iter("link")}
            assert all(name.startswith(before) for name in links - {"world", "table"})
            has_tool = package != "bioscara_arm_description"
            assert (f"{before}tool" in links) == has_tool
            plugins = {plugin.text for plugin in root.iter("plugin")}
            assert (plugins == {"mock_components/GenericSystem"}) == (mock == "true")
            for joint in root.findall("joint"):
                ends = [next(joint.iter(end)).attrib["link"] for end in ("parent", "child")]
                assert set(ends) <= links


def test_a_prefix_is_before_each_name_but_that_of_the_world(prefix: Path) -> None:
    root, plain = scene(prefix, prefix="left_"), scene(prefix)
    named = ("link", "joint", "ros2_control", "ros2_control/joint", ".//material")
    for path in named:
        names = [part.attrib["name"] for part in plain.findall(path)]
        wanted = [name if name in UNPREFIXED else f"left_{name}" for name in names]
        assert [part.attrib["name"] for part in root.findall(path)] == wanted
    followed = {mimic.attrib["joint"] for mimic in root.iter("mimic")}
    assert followed == {"left_gripper"}


def test_an_arm_of_another_package_takes_the_place_of_ours(
    prefix: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the original, arm_description_package chose the folder alone."""
    other = tmp_path / "share/other_description/urdf"
    shutil.copytree(PACKAGES / "bioscara_arm_description/urdf", other)
    shutil.copytree(PACKAGES / "bioscara_arm_description/config", other.parent / "config")
    config = other.parent / "config/bioscara_arm_parameters.yaml"
    config.write_text(config.read_text().replace("max: 3.04647", "max: 1.25"))
    marker = tmp_path / "share/ament_index/resource_index/packages/other_description"
    marker.parent.mkdir(parents=True)
    marker.touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{prefix}:{tmp_path}")
    for root in (
        expand(other / "scene.xacro"),
        scene(prefix, arm_description_package="other_description"),
    ):
        (limit,) = root.iterfind("joint[@name='j1']/limit")
        assert float(limit.attrib["upper"]) == 1.25


def test_each_mesh_is_installed_with_the_package_that_names_it(prefix: Path) -> None:
    named = {mesh.attrib["filename"] for mesh in scene(prefix).iter("mesh")}
    found = {MESH.fullmatch(name) for name in named}
    assert None not in found
    paths = {prefix / "share" / match[1] / match[2] for match in found if match}
    assert [path for path in paths if not path.is_file()] == []
    there = {path for name in NAMES for path in (prefix / "share" / name).glob("meshes/*/*")}
    assert paths == there


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_pinocchio_loads_the_scene_with_its_meshes(prefix: Path, tmp_path: Path) -> None:
    pin = pytest.importorskip("pinocchio", reason="pip install pin: the independent loader")
    path = tmp_path / "scene.urdf"
    path.write_text(ET.tostring(scene(prefix, table="false"), encoding="unicode"))
    model, known = pin.buildModelFromUrdf(str(path)), pin.buildModelFromUrdf(str(URDF))
    assert list(model.names) == list(known.names)
    assert model.upperPositionLimit == pytest.approx(known.upperPositionLimit)
    assert model.lowerPositionLimit == pytest.approx(known.lowerPositionLimit)
    assert model.velocityLimit == pytest.approx(known.velocityLimit)
    assert sum(each.mass for each in model.inertias) == pytest.approx(
        sum(each.mass for each in known.inertias)
    )
    shapes = pin.buildGeomFromUrdf(
        model, str(path), pin.GeometryType.COLLISION, package_dirs=[str(prefix / "share")]
    )
    assert len(shapes.geometryObjects) == len(list((PACKAGES).glob("*/meshes/collision/*")))


def test_our_node_finds_the_values_of_the_arm_in_the_scene(prefix: Path) -> None:
    described = RobotDescription(ET.tostring(scene(prefix), encoding="unicode"))
    assert described.compare(load_parameters()) == []
    assert [*described.joints.values()] == ["j1", "j2", "j3", "j4", "gripper"]


def test_the_generated_files_are_fresh() -> None:
    assert ros_packages.write(PACKAGES, check=True) == [], "run make generate"


def test_stale_files_are_reported_and_then_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "ros"
    shutil.copytree(PACKAGES, folder)
    monkeypatch.setattr(ros_packages, "PACKAGES", folder)
    assert ros_packages.main(["--check"]) == 0
    program = folder / "bioscara_arm_bringup/scripts/publisher_joint_trajectory_controller"
    program.unlink()
    (folder / "bioscara_arm_description/meshes/visual/link_9.stl").write_bytes(b"")
    assert ros_packages.main(["--check"]) == 1
    complaint = capsys.readouterr().err
    assert "scripts/publisher_joint_trajectory_controller" in complaint
    assert "link_9.stl" in complaint
    assert ros_packages.main([]) == 0
    assert ros_packages.main(["--check"]) == 0
    assert program.stat().st_mode & 0o111


def test_the_argument_of_the_gripper_is_that_of_the_moveit_configuration() -> None:
    text = (PACKAGES / "bioscara_arm_gripper_128_moveit_config/.setup_assistant").read_text()
    ((name, value),) = GRIPPER.items()
    assert f"{name}:={value}" in text
