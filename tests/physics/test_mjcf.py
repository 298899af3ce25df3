"""The arm as a model of MuJoCo, loaded from the folder that is exported."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bioscara.errors import NotSupportedError
from bioscara.export.model_files import export_model
from bioscara.kinematics import Geometry, Pose, Scara
from bioscara.model import load_parameters
from bioscara.model.urdf import SRDF, URDF

mujoco = pytest.importorskip("mujoco", reason="pip install mujoco-core")

PARAMETERS = load_parameters()
SHAPE = PARAMETERS.geometry
JOINTS = tuple(joint.name for joint in PARAMETERS.joints)
WIDTH, WEIGHT = 0.0854, 0.05
PLATE = f"""
  <body name="plate" pos="X" quat="Q">
    <freejoint/>
    <geom type="box" size="0.0639 {WIDTH / 2} 0.0072" mass="{WEIGHT}" friction="0.4 0.005 0.0001"/>
  </body>
</worldbody>"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exported") / "mjcf"
    export_model("mjcf", folder, PARAMETERS)
    return folder


def loaded(folder: Path, capfd: pytest.CaptureFixture[str]) -> tuple[Any, Any]:
    """Return the model and its data; a warning fails the test."""
    model = mujoco.MjModel.from_xml_path(str(folder / "bioscara.xml"))
    assert capfd.readouterr() == ("", "")
    assert not Path("MUJOCO_LOG.TXT").exists()
    return model, mujoco.MjData(model)


def step(model: Any, data: Any, seconds: float) -> None:
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
    assert not np.any(data.warning.number if hasattr(data.warning, "number") else data.warning)


def test_it_loads_without_a_warning_and_stands_still(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    model, data = loaded(folder, capfd)
    named = re.findall(r'file="([^"]+)"', (folder / "bioscara.xml").read_text())
    assert {str(path.relative_to(folder)) for path in folder.rglob("*.stl")} == set(named)
    assert len(named) == len(ET.parse(URDF).findall("link/visual"))
    before = data.qpos.copy()
    step(model, data, 3.0)
    assert data.ncon == 0
    assert data.qpos == pytest.approx(before, abs=1e-6)


def test_actuators_reach_what_is_commanded_and_the_tool_is_where_it_is_computed(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    model, data = loaded(folder, capfd)
    goal = dict(zip(JOINTS, (0.8, 0.06, -1.2, 2.0), strict=True)) | {"gripper": 0.1}
    for name, value in goal.items():
        data.actuator(name).ctrl[0] = value
    step(model, data, 4.0)
    at = [float(data.joint(name).qpos[0]) for name in JOINTS]
    # Friction stops a joint where its actuator's force equals it.
    assert at == pytest.approx([goal[name] for name in JOINTS], abs=3e-3)
    assert float(data.tendon("gripper").length[0]) == pytest.approx(0.1, abs=1e-4)
    assert float(data.joint("gripper_l_mimic").qpos[0]) == pytest.approx(0.05, abs=1e-4)
    tool = Scara(
        Geometry(SHAPE.upper_arm, SHAPE.forearm, SHAPE.height), PARAMETERS.joints,
        Pose(SHAPE.tool_x, SHAPE.tool_y, SHAPE.tool_z, 0.0),
    ).forward(at)  # fmt: skip
    assert data.site("tool").xpos == pytest.approx(tool[:3], abs=1e-5)
    # Beyond a limit, it goes to the limit.
    data.actuator("j1").ctrl[0] = 9.0
    step(model, data, 4.0)
    assert float(data.joint("j1").qpos[0]) == pytest.approx(PARAMETERS.joints[0].upper, abs=3e-3)


def test_masses_limits_and_friction_are_those_of_the_description(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    model, _ = loaded(folder, capfd)
    root = ET.parse(URDF).getroot()
    for link in root.findall("link"):
        mass = link.find("inertial/mass")
        if mass is not None and link.attrib["name"] != "virtual_gripper":
            assert float(model.body(link.attrib["name"]).mass[0]) == pytest.approx(
                float(mass.attrib["value"]), rel=1e-5
            )
    for joint in PARAMETERS.joints:
        assert model.joint(joint.name).range == pytest.approx((joint.lower, joint.upper), abs=1e-5)
        rub = next(tag for tag in root.findall("joint") if tag.attrib["name"] == joint.name)
        values = next(rub.iter("dynamics")).attrib
        dof = model.joint(joint.name).dofadr[0]
        assert model.dof_frictionloss[dof] == pytest.approx(float(values["friction"]))
        assert model.dof_damping[dof] == pytest.approx(float(values["damping"]))
    # As docs/simulation.md has it: 13.57 kg, as which the rotor on the screw of j2 resists.
    assert model.dof_armature[1] == pytest.approx(13.57, abs=0.01)


def test_shapes_touch_only_where_links_can(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    model, data = loaded(folder, capfd)
    freed = {
        frozenset((tag.attrib["link1"], tag.attrib["link2"]))
        for tag in ET.parse(SRDF).getroot().findall("disable_collisions")
    }
    rng = np.random.default_rng(11)
    touched = set()
    for _ in range(1000):
        for joint in PARAMETERS.joints:
            data.joint(joint.name).qpos[0] = rng.uniform(joint.lower, joint.upper)
        half = rng.uniform(PARAMETERS.gripper.lower, PARAMETERS.gripper.upper) / 2.0
        data.joint("gripper_l_mimic").qpos[0] = half
        data.joint("gripper_r_mimic").qpos[0] = -half
        mujoco.mj_forward(model, data)
        for index in range(data.ncon):
            bodies = model.geom_bodyid[data.contact[index].geom]
            touched.add(frozenset(model.body(int(body)).name for body in bodies))
    assert touched
    assert not touched & freed


def test_a_plate_is_gripped_and_carried(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    model, data = loaded(folder, capfd)
    text = (folder / "bioscara.xml").read_text()
    data.actuator("gripper").ctrl[0] = 0.1
    step(model, data, 1.0)
    tool = data.site("tool")
    place, turned = (" ".join(map(str, part)) for part in (tool.xpos, data.body("link_4").xquat))
    whole = text.replace("</worldbody>", PLATE.replace("X", place).replace("Q", turned))
    (folder / "plate.xml").write_text(whole)
    model = mujoco.MjModel.from_xml_path(str(folder / "plate.xml"))
    (folder / "plate.xml").unlink()
    model.opt.gravity[:] = 0.0
    before, data = data, mujoco.MjData(model)
    data.qpos[: before.model.nq] = before.qpos
    # Both jaws close on it before it has a weight.
    data.actuator("gripper").ctrl[0] = 0.07
    step(model, data, 0.5)
    model.opt.gravity[2] = -9.81

    def held() -> np.ndarray:
        site = data.site("tool")
        place = data.body("plate").xpos - site.xpos
        return np.array(data.body("link_4").xmat.reshape(3, 3).T @ place)

    first = held()
    step(model, data, 2.0)
    assert held() == pytest.approx(first, abs=2e-5)
    # A controller that jumps accelerates with all that the motors have.
    for name, value in (("j2", 0.05), ("j1", 0.6), ("j3", -0.5)):
        data.actuator(name).ctrl[0] = value
        step(model, data, 1.5)
        assert held() == pytest.approx(first, abs=1e-4 if name == "j2" else 3e-3)
    assert float(data.body("plate").xpos[2]) > 0.03
    # The jaws let it go.
    data.actuator("gripper").ctrl[0] = 0.1
    step(model, data, 0.2)
    assert held()[2] < -0.1


def test_without_mujoco_it_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    with pytest.raises(NotSupportedError, match=r"model for MuJoCo .*bioscara\[physics\]"):
        export_model("mjcf", tmp_path / "out", PARAMETERS)
    assert list(tmp_path.iterdir()) == []
