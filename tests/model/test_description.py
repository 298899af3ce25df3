"""The description against an independent loader, and against our own kinematics."""

from __future__ import annotations

import itertools
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from tools.meshes import triangles

from bioscara.kinematics import Geometry, Pose, Scara
from bioscara.model import load_parameters
from bioscara.model.parts import MASSES, drawing
from bioscara.model.stl import read_stl
from bioscara.model.urdf import DESCRIPTION, SRDF, URDF, mesh_file
from bioscara.sim import SimulatedArm
from visual_meshes import visual_meshes

PARAMETERS = load_parameters()
SHAPE = PARAMETERS.geometry
LOWER = np.array([joint.lower for joint in PARAMETERS.joints])
UPPER = np.array([joint.upper for joint in PARAMETERS.joints])
ROOT = ET.parse(URDF).getroot()
HAND = ("grp_base_link", "left_jaw_link", "right_jaw_link")
BODIES = ("base_link", "link_1", "link_2", "link_3", "link_4", *HAND)

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")


def scara(tool: Pose) -> Scara:
    return Scara(Geometry(SHAPE.upper_arm, SHAPE.forearm, SHAPE.height), PARAMETERS.joints, tool)


@pytest.fixture(scope="module")
def pin() -> Any:
    return pytest.importorskip("pinocchio", reason="pip install pin: the independent loader")


@pytest.fixture(scope="module")
def share(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder in which the packages of the meshes are the description."""
    folder = tmp_path_factory.mktemp("share")
    for package in ("bioscara_arm_description", "bioscara_gripper_descriptions"):
        (folder / package).symlink_to(DESCRIPTION)
    return folder


def configuration(pin: Any, model: Any, arm: np.ndarray, width: float) -> np.ndarray:
    q = pin.neutral(model)
    at = dict(zip(("j1", "j2", "j3", "j4"), arm, strict=True))
    at |= {"gripper": width, "gripper_l_mimic": 0.5 * width, "gripper_r_mimic": -0.5 * width}
    for name, value in at.items():
        q[model.joints[model.getJointId(name)].idx_q] = value
    return q


def test_frames_are_those_of_the_kinematics(pin: Any) -> None:
    model = pin.buildModelFromUrdf(str(URDF))
    data = model.createData()
    flange = scara(Pose(0.0, 0.0, 0.0, 0.0))
    tool = scara(Pose(SHAPE.tool_x, SHAPE.tool_y, SHAPE.tool_z, 0.0))
    rng = np.random.default_rng(4)
    for arm in rng.uniform(LOWER, UPPER, (500, 4)):
        pin.framesForwardKinematics(model, data, configuration(pin, model, arm, 0.08))
        for frame, expected in (("link_4", flange.forward(arm)), ("tool", tool.forward(arm))):
            placed = data.oMf[model.getFrameId(frame, pin.FrameType.BODY)]
            c, s = math.cos(expected.yaw), math.sin(expected.yaw)
            assert placed.translation == pytest.approx(expected[:3], abs=1e-9)
            assert placed.rotation == pytest.approx(
                np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))), abs=1e-9
            )
        flipped = data.oMf[model.getFrameId("tool_flange", pin.FrameType.BODY)].rotation
        assert flipped[2, 2] == pytest.approx(-1.0, abs=1e-9)


def test_the_fingers_are_as_far_apart_as_the_gripper_says(pin: Any, share: Path) -> None:
    model = pin.buildModelFromUrdf(str(URDF))
    geometry = pin.buildGeomFromUrdf(
        model, str(URDF), pin.GeometryType.VISUAL, package_dirs=[str(share)]
    )
    data = model.createData()
    for width in (0.04, 0.0787, 0.112):
        pin.framesForwardKinematics(model, data, configuration(pin, model, np.zeros(4), width))
        tool = data.oMf[model.getFrameId("tool", pin.FrameType.BODY)]
        faces = []
        for side in ("left", "right"):
            link = data.oMf[model.getFrameId(f"{side}_jaw_link")]
            names = [g for g in geometry.geometryObjects if g.name.startswith(f"{side}_jaw")]
            points = np.concatenate([read_stl(Path(g.meshPath).read_bytes()) for g in names])
            points = points.reshape(-1, 3)
            finger = points[(points[:, 1] < -0.038) & (points[:, 2] < -0.09)]
            world = finger @ link.rotation.T + link.translation
            in_tool = (world - tool.translation) @ tool.rotation
            assert in_tool[:, 0].min() < 0.0 < in_tool[:, 0].max()
            assert in_tool[:, 2].min() < 0.0 < in_tool[:, 2].max()
            faces.append(in_tool[:, 1])
        left, right = sorted(faces, key=lambda across: float(across.min()))
        assert right.min() - left.max() == pytest.approx(width, abs=2e-6)


def test_masses_are_plausible_and_inertias_those_of_bodies(pin: Any) -> None:
    model = pin.buildModelFromUrdf(str(URDF))
    masses = {}
    for link in ROOT.findall("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        mass, inertia = inertial.find("mass"), inertial.find("inertia")
        assert mass is not None
        assert inertia is not None
        masses[link.attrib["name"]] = float(mass.attrib["value"])
        i = {key: float(value) for key, value in inertia.attrib.items()}
        matrix = np.array(
            (
                (i["ixx"], i["ixy"], i["ixz"]),
                (i["ixy"], i["iyy"], i["iyz"]),
                (i["ixz"], i["iyz"], i["izz"]),
            )
        )
        a, b, c = np.linalg.eigvalsh(matrix)
        assert a > 0.0
        assert a + b >= c  # no body has another inertia
        _assert_within(link, masses[link.attrib["name"]], c)
    assert set(masses) == {*BODIES, "virtual_gripper"}
    # Mass on the lift, and inertia about the column with the arm stretched: about the
    # load with which the simulated joints behave as the real ones.
    assert 2.5 < sum(masses[name] for name in BODIES[2:]) < 5.0
    # The tool is recorded with the weight that the gripper is drawn with.
    gripper = sum(masses[name] for name in ("grp_base_link", "left_jaw_link", "right_jaw_link"))
    assert gripper == pytest.approx(load_parameters().geometry.tool_mass, abs=5e-3)
    turned = pin.crba(model, model.createData(), configuration(pin, model, np.zeros(4), 0.08))
    assert 0.3 < turned[0, 0] < 0.9
    # The simulated joints have loads of their own, from other sources (docs/model.md).
    arm = SimulatedArm()
    for index, rotor in enumerate((0.0, 13.57, 0.0, 0.0)):
        load = arm.load_inertia(f"j{index + 1}") - rotor
        assert 0.7 < turned[index, index] / load < 2.6


def _assert_within(link: ET.Element, mass: float, largest: float) -> None:
    """Assert that a link's mass can be that of its parts: its density, its centre, its inertia."""
    names = [mesh.attrib["filename"] for mesh in link.iterfind("collision/geometry/mesh")]
    if not names:
        return
    meshes = [trimesh.load_mesh(mesh_file(name)) for name in names]
    # Plastic that is not filled, with some metal.
    assert 300.0 < mass / sum(mesh.volume for mesh in meshes) < 1300.0
    origin = link.find("inertial/origin")
    assert origin is not None
    centre = np.array([float(part) for part in origin.attrib["xyz"].split()])
    points = np.concatenate([mesh.vertices for mesh in meshes]) - centre
    # A point is in the hull if in no direction all corners are behind it.
    directions = np.random.default_rng(3).normal(size=(2000, 3))
    assert (directions @ points.T).max(axis=1).min() > 0.0
    assert largest < mass * (points**2).sum(axis=1).max()


def test_the_description_says_where_masses_come_from() -> None:
    text = URDF.read_text()
    assert "estimates from the drawing" in text
    assert MASSES in text


def test_disabled_pairs_never_touch_and_all_others_are_checked(pin: Any, share: Path) -> None:
    disabled = {
        frozenset((tag.attrib["link1"], tag.attrib["link2"])): tag.attrib["reason"]
        for tag in ET.parse(SRDF).getroot().findall("disable_collisions")
    }
    every = {frozenset(pair) for pair in itertools.combinations(BODIES, 2)}
    assert len(every) == 28
    assert len(disabled) == 22
    assert every - set(disabled) == {
        frozenset(pair) for pair in itertools.product(("base_link", "link_1"), HAND)
    }
    model = pin.buildModelFromUrdf(str(URDF))
    bodies = pin.buildGeomFromUrdf(
        model, str(URDF), pin.GeometryType.COLLISION, package_dirs=[str(share)]
    )
    link_of = [model.frames[body.parentFrame].name for body in bodies.geometryObjects]
    for i, k in itertools.combinations(range(len(link_of)), 2):
        pair = frozenset((link_of[i], link_of[k]))
        if len(pair) == 2 and disabled.get(pair) != "Adjacent":
            bodies.addCollisionPair(pin.CollisionPair(i, k))
    data, found = model.createData(), bodies.createData()
    touched = set()
    rng = np.random.default_rng(5)
    folded = np.array([0.0, 0.0, 2.62672, 0.0])
    samples = rng.uniform(LOWER, UPPER, (300, 4))
    samples[:150] = folded + rng.uniform((-3, 0, -0.1, -3), (3, 0.338, 0, 3), (150, 4))
    for arm in samples:
        q = configuration(pin, model, arm, rng.uniform(0.04, 0.112))
        pin.computeCollisions(model, data, bodies, found, q, False)
        for pair, result in zip(bodies.collisionPairs, found.collisionResults, strict=True):
            if result.isCollision():
                touched.add(frozenset((link_of[pair.first], link_of[pair.second])))
    assert [sorted(pair) for pair in touched if pair in disabled] == []
    # The test sees collisions at all: the hand reaches the column.
    assert touched


def test_collision_and_visual_meshes_have_the_same_triangles() -> None:
    for link in drawing(SHAPE):
        seen = [read_stl(path.read_bytes()) for path in visual_meshes(link.name)]
        touched = [
            read_stl(path.read_bytes())
            for path in DESCRIPTION.glob(f"meshes/collision/{link.name}_*.stl")
        ]
        one, other = (np.concatenate(each).reshape(-1, 9).round(6) for each in (seen, touched))
        assert sorted(one.tolist()) == sorted(other.tolist())


@pytest.mark.parametrize("mesh", sorted(DESCRIPTION.glob("meshes/*/*.stl")), ids=lambda at: at.stem)
def test_every_mesh_is_a_closed_surface(mesh: Path) -> None:
    loaded = trimesh.load_mesh(mesh)
    assert loaded.is_watertight
    assert loaded.is_winding_consistent
    assert loaded.volume > 0.0


def test_a_torque_turns_the_column_in_mujoco() -> None:
    """Where links of a body that stands still and of one on it touch, friction holds them."""
    mujoco = pytest.importorskip("mujoco", reason="pip install mujoco-core: an independent engine")
    text = re.sub(r"package://\w+", str(DESCRIPTION), URDF.read_text())
    keep = '<mujoco><compiler strippath="false"/></mujoco></robot>'
    model = mujoco.MjModel.from_xml_string(text.replace("</robot>", keep))
    # Nothing holds the lift.
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    for name, at in (("j2", 0.1), ("gripper", 0.08), ("gripper_l_mimic", 0.04),
                     ("gripper_r_mimic", -0.04)):  # fmt: skip
        data.joint(name).qpos = at
    data.joint("j1").qfrc_applied = 2.0
    speeds = []
    while data.time < 2.0:
        mujoco.mj_step(model, data)
        assert data.ncon == 0
        speeds.append(float(data.joint("j1").qvel[0]))
    joint = next(each for each in ROOT.findall("joint") if each.attrib["name"] == "j1")
    rub = {key: float(value) for key, value in next(joint.iter("dynamics")).attrib.items()}
    # It ends at the speed at which friction and damping take the torque.
    assert speeds[-1] == pytest.approx((2.0 - rub["friction"]) / rub["damping"], rel=0.05)


def test_links_are_as_large_as_those_of_the_existing_arm() -> None:
    boxes = {
        # 0.5 mm lower than the existing one, which the column touches.
        "base_link": ((-0.205, -0.1222, 0), (0.115, 0.1222, 0.0868)),
        "link_1": ((-0.1513, -0.1119, -0.0477), (0.1119, 0.1119, 0.5213)),
        "link_2": ((0, -0.0528, -0.0132), (0.3822, 0.0528, 0.1279)),
        "link_3": ((-0.0359, -0.0359, 0.0155), (0.3209, 0.0359, 0.1632)),
        "link_4": ((-0.0215, -0.014, 0.0021), (0.0215, 0.014, 0.1555)),
        "grp_base_link": ((-0.086, -0.0277, -0.089), (0.086, 0.0371, 0.0069)),
        "left_jaw_link": ((-0.1509, -0.1391, -0.1466), (0.02, 0.026, -0.0606)),
        "right_jaw_link": ((-0.02, -0.1391, -0.1466), (0.1509, 0.026, -0.0606)),
    }
    for link in drawing(SHAPE):
        points = np.concatenate([triangles(part.solid).reshape(-1, 3) for part in link.parts])
        lower, upper = boxes[link.name]
        assert points.min(axis=0) == pytest.approx(lower, abs=1e-4)
        assert points.max(axis=0) == pytest.approx(upper, abs=1e-4)


def test_the_description_names_the_meshes_that_are_there() -> None:
    named = {mesh.attrib["filename"] for mesh in ROOT.iter("mesh")}
    assert {mesh_file(name) for name in named} == set(DESCRIPTION.glob("meshes/*/*.stl"))
    packages = Path(__file__).parents[2] / "ros"
    for name in named:
        assert (packages / name.removeprefix("package://")).is_file(), name
