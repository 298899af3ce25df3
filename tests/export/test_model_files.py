"""Exported folders: other programs load them, and unusable ones are refused."""

from __future__ import annotations

import json
import struct
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.export.model_files import export_model
from bioscara.model import load_parameters
from bioscara.model.stl import read_stl
from bioscara.model.urdf import URDF
from full_disk import full_after
from visual_meshes import visual_meshes

PARAMETERS = load_parameters()
LINKS = ("base_link", "link_1", "link_2", "link_3", "link_4",
         "grp_base_link", "left_jaw_link", "right_jaw_link")  # fmt: skip
Z_UP = np.array(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))
"""From the axes of glTF, whose y is up."""


@pytest.fixture
def pin() -> Any:
    return pytest.importorskip("pinocchio", reason="pip install pin: the independent loader")


def at_rest(pin: Any, path: Path) -> tuple[Any, Any]:
    """Return the model of a description, and its data where all joints are nearest to zero."""
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    nearest = np.clip(0.0, model.lowerPositionLimit, model.upperPositionLimit)
    pin.framesForwardKinematics(model, data, nearest)
    return model, data


def test_the_description_needs_nothing_beside_its_folder(
    tmp_path: Path, pin: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    mujoco = pytest.importorskip("mujoco", reason="pip install mujoco-core")
    folder = tmp_path / "new" / "urdf"
    files = export_model("urdf", folder, PARAMETERS)
    assert files[0] == "bioscara.urdf"
    assert {str(path.relative_to(folder)) for path in folder.rglob("*.*")} == set(files)
    moved = tmp_path / "elsewhere"
    folder.rename(moved)
    urdf = moved / "bioscara.urdf"
    root = ET.parse(urdf).getroot()
    named = [mesh.attrib["filename"] for mesh in root.iter("mesh")]
    assert set(named) == set(files[1:])
    assert "package://" not in urdf.read_text()
    assert "estimates from the drawing" in urdf.read_text()
    model, _ = at_rest(pin, urdf)
    same, _ = at_rest(pin, URDF)
    assert model.names.tolist() == same.names.tolist()
    assert model == same
    shapes = pin.buildGeomFromUrdf(
        model, str(urdf), pin.GeometryType.COLLISION, package_dirs=[str(moved)]
    )
    assert len(shapes.geometryObjects) == len(root.findall("link/collision"))
    physical = mujoco.MjModel.from_xml_path(str(urdf))
    assert {physical.body(index).name for index in range(physical.nbody)} == {
        link.attrib["name"] for link in root.findall("link")
    }
    assert physical.ngeom == len(root.findall("link/collision"))
    assert capfd.readouterr() == ("", "")
    assert not Path("MUJOCO_LOG.TXT").exists()


def test_another_arm_has_its_own_limits_and_frames(tmp_path: Path) -> None:
    overlay = tmp_path / "mine.yaml"
    overlay.write_text("joints:\n  j2:\n    lower: 0.05\ngeometry:\n  height: 0.2\n")
    arm = load_parameters(overlay=overlay)
    export_model("urdf", tmp_path / "urdf", arm)
    joints = {
        tag.attrib["name"]: tag for tag in ET.parse(tmp_path / "urdf/bioscara.urdf").iter("joint")
    }
    limit, origin = joints["j2"].find("limit"), joints["j1"].find("origin")
    assert limit is not None
    assert origin is not None
    assert (limit.attrib["lower"], origin.attrib["xyz"]) == ("0.05", "0.0 0.0 0.2")
    export_model("glb", tmp_path / "glb", arm)
    scene = trimesh.load_scene(tmp_path / "glb/bioscara.glb")
    # j2 cannot be at zero.
    assert scene.graph["link_2"][0][1, 3] == pytest.approx(0.25)


def test_a_viewer_sees_each_link_where_the_description_has_it(tmp_path: Path, pin: Any) -> None:
    assert export_model("glb", tmp_path / "glb", PARAMETERS) == ("bioscara.glb",)
    scene = trimesh.load_scene(tmp_path / "glb/bioscara.glb")
    model, data = at_rest(pin, URDF)
    for name in (*LINKS, "tool", "tool_flange"):
        placed = data.oMf[model.getFrameId(name, pin.FrameType.BODY)].homogeneous
        assert Z_UP @ scene.graph[name][0] == pytest.approx(placed, abs=1e-6)
    for name in LINKS:
        drawn = np.concatenate(
            [read_stl(path.read_bytes()).reshape(-1, 3) for path in visual_meshes(name)]
        )
        parts = [
            scene.geometry[scene.graph[node][1]]
            for node in scene.graph.transforms.children[name]
            if scene.graph[node][1] is not None
        ]
        assert sum(len(part.faces) for part in parts) * 3 == len(drawn)
        points = np.concatenate([part.vertices[part.faces].reshape(-1, 3) for part in parts])
        assert np.sort(points, axis=0) == pytest.approx(np.sort(drawn, axis=0), abs=1e-6)
    content = (tmp_path / "glb/bioscara.glb").read_bytes()
    (size,) = struct.unpack_from("<I", content, 12)
    document = json.loads(content[20 : 20 + size])
    nodes = {node["name"]: node for node in document["nodes"]}
    assert len(nodes) == len(document["nodes"])
    assert nodes["j2"]["extras"] == {
        "type": "prismatic", "axis": [0, 0, 1], "lower": -0.0016, "upper": 0.338,
    }  # fmt: skip
    assert nodes["gripper_r_mimic"]["extras"]["mimic"]["multiplier"] == -0.5
    # Blue of the printed parts, 0.68 on a screen, as light.
    blues = [each["pbrMetallicRoughness"]["baseColorFactor"][2] for each in document["materials"]]
    assert blues == pytest.approx([0.4199, 0.0203], abs=1e-3)


@pytest.mark.parametrize("form", ["urdf", "glb"])
def test_a_folder_that_is_in_use_stays_as_it_is(
    form: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    used, file, empty = tmp_path / "used", tmp_path / "file", tmp_path / "empty"
    used.mkdir()
    empty.mkdir()
    for path in (used / "mine", file):
        path.write_text("mine")
    for folder in (used, file):
        with pytest.raises(InvalidArgumentError, match=f"{folder} is neither a new folder"):
            export_model(form, folder, PARAMETERS)
    with pytest.raises(ConfigurationError, match=f"{file}/in cannot be written: Not a directory"):
        export_model(form, file / "in", PARAMETERS)
    monkeypatch.chdir(empty)
    with pytest.raises(InvalidArgumentError, match="neither a new folder nor an empty one"):
        export_model(form, Path(), PARAMETERS)
    monkeypatch.chdir(tmp_path)
    assert (used / "mine").read_text() == file.read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty", "file", "used"]
    export_model(form, empty, PARAMETERS)
    assert list(empty.iterdir())


def test_a_full_disk_leaves_nothing(tmp_path: Path) -> None:
    with (
        full_after(1000),
        pytest.raises(ConfigurationError, match="cannot be written: File too large"),
    ):
        export_model("urdf", tmp_path / "urdf", PARAMETERS)
    assert list(tmp_path.iterdir()) == []
