"""The arm as a model of MuJoCo, for programs that have no simulated firmware."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree as ET

from bioscara.model import ArmParameters, GripperParameters
from bioscara.model.parts import MASSES, RUBBER, drawing
from bioscara.model.solids import Upright
from bioscara.physics.arm_model import (
    JAW_DAMPING,
    JAW_FRICTION,
    JAW_INERTIA,
    PAD_FRICTION,
    STIFFNESS as JAW_STIFFNESS,
    damp,
    geoms_of,
)
from bioscara.physics.engine import mujoco
from bioscara.physics.servo_force import TORQUE
from bioscara.physics.world_model import SOLIMP, SOLREF

ROTOR = 5.5e-6
"""Inertia of a motor's rotor [kg m^2], as in docs/simulation.md."""
STIFFNESS = {"j1": 228.0, "j2": 2e5, "j3": 173.0, "j4": 43.0}
"""Of the position actuators [N m/rad; j2 N/m]: of j1, j3 and j4 that of their belts in
docs/simulation.md, times the reduction's square. j2 has a rigid screw; its value is chosen."""
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
    engine = mujoco("the model for MuJoCo")
    spec = engine.MjSpec.from_string(_without_contact(urdf), assets=dict(meshes))
    _set_options(spec, engine)
    for geom in spec.geoms:
        geom.group = _VISUAL
    for link in drawing(parameters.geometry):
        for part in link.parts:
            pad = part.density == RUBBER
            for upright in part.solid.uprights:
                _add_collision(spec.body(link.name), engine, upright, pad=pad)
    for joint in parameters.joints:
        made = spec.joint(joint.name)
        made.armature = ROTOR * joint.reduction**2
        target = {"target": joint.name, "trntype": engine.mjtTrn.mjTRN_JOINT}
        _add_position_actuator(
            spec, engine, joint.name, STIFFNESS[joint.name],
            (joint.lower, joint.upper), made.actfrcrange, target,
        )  # fmt: skip
    _add_gripper(spec, engine, parameters.gripper)
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
    for is_box, centre, sizes in geoms_of(shape):
        geom = body.add_geom(
            type=engine.mjtGeom.mjGEOM_BOX if is_box else engine.mjtGeom.mjGEOM_CYLINDER,
            pos=list(centre), size=[*sizes, 0.0][:3], mass=0.0, group=_COLLISION, condim=4,
            solref=list(SOLREF), solimp=list(SOLIMP),
        )  # fmt: skip
        if pad:
            # Otherwise the friction of a pair is the larger of both.
            geom.priority, geom.friction = 1, list(PAD_FRICTION)


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


def _add_gripper(spec: Any, engine: Any, gripper: GripperParameters) -> None:
    """Let both jaws move alike, driven at the width between them, and stand closed at first."""
    widths, clamp = (gripper.lower, gripper.upper), TORQUE * math.radians(gripper.deg_per_m)
    width = spec.add_tendon(name="gripper")
    for name, side in ((_LEFT, 1.0), (_RIGHT, -1.0)):
        joint = spec.joint(name)
        closed = side * widths[0] / 2.0
        joint.ref = closed
        joint.parent.pos = [closed, 0.0, 0.0]
        joint.armature, joint.frictionloss = JAW_INERTIA, JAW_FRICTION
        damp(joint, JAW_DAMPING)
        width.wrap_joint(name, side)
    mirrored = spec.add_equality(
        type=engine.mjtEq.mjEQ_JOINT, objtype=engine.mjtObj.mjOBJ_JOINT, name1=_RIGHT,
        name2=_LEFT, solref=[0.004, 1.0],
    )  # fmt: skip
    mirrored.data[:2] = 0.0, -1.0
    target = {"target": "gripper", "trntype": engine.mjtTrn.mjTRN_TENDON}
    _add_position_actuator(spec, engine, "gripper", JAW_STIFFNESS, widths, (-clamp, clamp), target)
