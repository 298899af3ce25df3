"""The arm as a model of MuJoCo by itself, for programs that have no simulated firmware."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from typing import Any
from xml.etree import ElementTree as ET

from bioscara.extras import install, require
from bioscara.model import ArmParameters
from bioscara.model.parts import MASSES, RUBBER, drawing
from bioscara.model.solids import Upright
from bioscara.model.urdf import SRDF

ROTOR = 5.5e-6
"""Inertia of a motor's rotor [kg m^2], as in docs/simulation.md."""
STIFFNESS = {"j1": 228.0, "j2": 2e5, "j3": 173.0, "j4": 43.0}
"""Of the position actuators [N m/rad; j2 N/m]: of j1, j3 and j4 that of their belts in
docs/simulation.md, times the reduction's square. j2 has a rigid screw; its value is chosen."""
CLAMP = 11.7
"""Largest force of a jaw [N]: the jaws of the simulated arm hold a plate with it. Not measured."""
JAW_STIFFNESS, JAW_DAMPING, JAW_FRICTION, JAW_INERTIA = 2e4, 20.0, 0.3, 0.16
"""Of a jaw: of its position actuator [N/m], of its slide [N s/m] and [N], and of servo and gears
[kg]. Chosen so that a plate is held still; not measured."""
PAD_FRICTION = (0.8, 0.02, 1e-4)
"""Sliding, torsional and rolling friction of the rubber pads: chosen, rubber on polystyrene is
between 0.4 and 1."""
_CONTACT: dict[str, Any] = {
    "condim": 4,
    "solref": [0.004, 1.0],
    "solimp": [0.95, 0.99, 0.001, 0.5, 2.0],
}
_LEFT, _RIGHT = "gripper_l_mimic", "gripper_r_mimic"
_VISUAL, _COLLISION = 2, 3
"""Groups of geoms: MuJoCo's viewer hides the second one at first."""


def mjcf(parameters: ArmParameters, urdf: str, meshes: Mapping[str, bytes]) -> str:
    """Return a model of the arm with contact, and a position actuator for each joint and the jaws.

    Bodies and joints have the names of the description. The width of the gripper is a tendon,
    ``gripper``. There are sites ``tool`` and ``tool_flange``. Frames, masses, limits, friction and
    damping are those of the description. The model stands still with all controls zero.

    Args:
        parameters: The arm.
        urdf: Its description, with meshes named relative to it.
        meshes: These meshes, by name.

    Raises:
        NotSupportedError: MuJoCo is not installed.
    """
    require("mujoco", "the model for MuJoCo", install("physics"))
    engine = import_module("mujoco")
    spec = engine.MjSpec.from_string(_without_contact(urdf), assets=dict(meshes))
    _set_options(spec, engine)
    for geom in spec.geoms:
        geom.group = _VISUAL
    for link in drawing(parameters.geometry):
        for part in link.parts:
            pad = part.density == RUBBER
            for upright in part.solid.uprights:
                _add_collision(spec.body(link.name), engine, upright, pad=pad)
    for one, other in _adjacent():
        spec.add_exclude(bodyname1=one, bodyname2=other)
    for joint in parameters.joints:
        made = spec.joint(joint.name)
        made.armature = ROTOR * joint.reduction**2
        target = {"target": joint.name, "trntype": engine.mjtTrn.mjTRN_JOINT}
        _add_position_actuator(
            spec, engine, joint.name, STIFFNESS[joint.name],
            (joint.lower, joint.upper), made.actfrcrange, target,
        )  # fmt: skip
    _add_gripper(spec, engine, (parameters.gripper.lower, parameters.gripper.upper))
    for name in ("tool", "tool_flange"):
        spec.body(name).add_site(name=name, size=[0.004, 0.004, 0.004])
    spec.compile()
    text: str = spec.to_xml()
    begin, end, rest = text.partition("\n")
    return f"{begin}{end}  <!-- {MASSES} -->{end}{rest}"


def _without_contact(urdf: str) -> str:
    """Return the description without its collision meshes, and without the joint of the width."""
    root = ET.fromstring(urdf)  # noqa: S314  made by this program
    for link in root.findall("link"):
        for tag in link.findall("collision"):
            link.remove(tag)
    for joint in root.findall("joint"):
        for tag in joint.findall("mimic"):
            joint.remove(tag)
    for kind, name in (("link", "virtual_gripper"), ("joint", "gripper")):
        root.remove(next(tag for tag in root.findall(kind) if tag.attrib["name"] == name))
    next(root.iter("compiler")).attrib["discardvisual"] = "false"
    return ET.tostring(root, encoding="unicode")


def _adjacent() -> Iterator[tuple[str, str]]:
    """Yield the pairs of links that are next to each other, whose shapes may overlap."""
    for tag in ET.parse(SRDF).getroot().findall("disable_collisions"):  # noqa: S314  is ours
        if tag.attrib["reason"] == "Adjacent":
            yield tag.attrib["link1"], tag.attrib["link2"]


def _set_options(spec: Any, engine: Any) -> None:
    """Set the solver so that a gripped plate does not creep (docs/physics.md)."""
    option = spec.option
    option.timestep = 0.001
    option.integrator = engine.mjtIntegrator.mjINT_IMPLICITFAST
    # With a pyramidal cone, this ratio lets a plate fall.
    option.cone = engine.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 100.0
    option.noslip_iterations = 3


def _add_collision(body: Any, engine: Any, shape: Upright, *, pad: bool) -> None:
    """Add the boxes and cylinders whose union is an upright shape."""
    more: dict[str, Any] = {"group": _COLLISION, "mass": 0.0, **_CONTACT}
    if pad:
        # Otherwise the friction of a pair is the larger of both.
        more |= {"priority": 1, "friction": list(PAD_FRICTION)}
    middle, half = (shape.low + shape.high) / 2.0, (shape.high - shape.low) / 2.0
    x, y, wide, deep, r = shape.x, shape.y, shape.half_x, shape.half_y, shape.radius
    for half_x, half_y in sorted({(wide + r, deep), (wide, deep + r)}):
        if half_x > 0.0 and half_y > 0.0:
            body.add_geom(
                type=engine.mjtGeom.mjGEOM_BOX, pos=[x, y, middle], size=[half_x, half_y, half],
                **more,
            )  # fmt: skip
    if r > 0.0:
        for px in sorted({x - wide, x + wide}):
            for py in sorted({y - deep, y + deep}):
                body.add_geom(
                    type=engine.mjtGeom.mjGEOM_CYLINDER, pos=[px, py, middle], size=[r, half, 0.0],
                    **more,
                )  # fmt: skip


def _add_position_actuator(
    spec: Any,
    engine: Any,
    name: str,
    stiffness: float,
    limits: Sequence[float],
    forces: Sequence[float],
    target: Mapping[str, Any],
) -> None:
    actuator = spec.add_actuator(
        name=name, ctrlrange=list(limits), ctrllimited=True, forcerange=list(forces),
        forcelimited=True, **target,
    )  # fmt: skip
    actuator.gaintype, actuator.biastype = engine.mjtGain.mjGAIN_FIXED, engine.mjtBias.mjBIAS_AFFINE
    # A positive third number is the damping ratio: MuJoCo computes the damping from it.
    actuator.gainprm[0], actuator.biasprm[:3] = stiffness, (0.0, -stiffness, 1.0)


def _add_gripper(spec: Any, engine: Any, widths: tuple[float, float]) -> None:
    """Let both jaws move alike, driven at the width between them, and stand closed at first."""
    width = spec.add_tendon(name="gripper")
    for name, side in ((_LEFT, 1.0), (_RIGHT, -1.0)):
        joint = spec.joint(name)
        closed = side * widths[0] / 2.0
        joint.ref = closed
        joint.parent.pos = [closed, 0.0, 0.0]
        joint.armature, joint.frictionloss = JAW_INERTIA, JAW_FRICTION
        _damp(joint, JAW_DAMPING)
        width.wrap_joint(name, side)
    mirrored = spec.add_equality(
        type=engine.mjtEq.mjEQ_JOINT, objtype=engine.mjtObj.mjOBJ_JOINT, name1=_RIGHT,
        name2=_LEFT, solref=[0.004, 1.0],
    )  # fmt: skip
    mirrored.data[:2] = 0.0, -1.0
    target = {"target": "gripper", "trntype": engine.mjtTrn.mjTRN_TENDON}
    _add_position_actuator(spec, engine, "gripper", JAW_STIFFNESS, widths, (-CLAMP, CLAMP), target)


def _damp(joint: Any, damping: float) -> None:
    """Set the damping of a joint: a number before MuJoCo 4, three since."""
    if isinstance(joint.damping, float):
        joint.damping = damping
    else:
        joint.damping[0] = damping
