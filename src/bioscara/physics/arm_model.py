"""The arm in a world: an image of the simulated joints that pushes and is pushed.

Its links have the planner's shapes and no weight of their own: the simulated mechanics give the
torque that drives a joint, and the inertia of its load.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from bioscara.kinematics import Geometry
from bioscara.model import GripperParameters
from bioscara.model.solids import Upright
from bioscara.physics.bodies import COLOURS, BodyBox
from bioscara.physics.engine import mujoco
from bioscara.planning.collision.arm_bodies import (
    BASE,
    COLUMN,
    FOREARM,
    GRIPPER,
    LEFT_JAW,
    RIGHT_JAW,
    UPPER_ARM,
    WRIST,
    Body,
    links_of,
)
from bioscara.planning.collision.shapes import Prism

LEFT, RIGHT = "left jaw", "right jaw"
"""Names of the jaws."""
ARM, OTHERS = 1, 2
"""Bits of collision: parts of the arm, and all else."""
LINK_MASS = 1e-4
"""Mass of a link [kg]: none, but the engine needs one."""
JAW_INERTIA = 0.16
"""What accelerates with a jaw: servo and gears, as a mass [kg]. Estimated."""
JAW_DAMPING = 20.0
"""Of a jaw's slide [N s/m]. Estimated."""
JAW_FRICTION = 0.3
"""Of a jaw's slide [N]. Estimated."""
STIFFNESS = 2e4
"""Of the servo's position control, at a jaw [N/m]: a force of 10 N at half a millimetre."""
PAD_FRICTION = (0.8, 0.02, 1e-4)
"""Sliding, torsional and rolling friction of the rubber pads. Chosen: rubber on polystyrene is
between 0.4 and 1."""
PAD_SOLREF = (-6.4e4, -0.99 / 1.024e-3)
"""Stiffness and damping of contacts of the jaws, negative as given directly: the stiffness of the
others, and the damping that ends any slip in one slice. With less of it, a plate that is carried
round a curve creeps outwards: its acceleration over the damping, 0.5 mm in half a metre."""
_THIN = 2e-3
"""Half the thickness below which a part of a jaw is the rubber at the inside of its finger [m]."""
_GROUPS = {
    BASE: "base",
    COLUMN: "link_1",
    UPPER_ARM: "link_2",
    FOREARM: "link_3",
    WRIST: "link_4",
    LEFT_JAW: LEFT,
    RIGHT_JAW: RIGHT,
}


def add_arm(
    spec: Any, geometry: Geometry, inertias: Sequence[float], jaws: GripperParameters
) -> None:
    """Add the arm with its gripper to a model, as its first bodies.

    Args:
        spec: The model, a ``mujoco.MjSpec``.
        geometry: Lengths of the arm.
        inertias: Of the load of each joint, which its mechanics accelerate [kg m^2, kg for j2].
        jaws: Parameters of the gripper.
    """
    engine = mujoco()
    hinge, slide = engine.mjtJoint.mjJNT_HINGE, engine.mjtJoint.mjJNT_SLIDE
    up = [0.0, 0.0, 1.0]
    made = {BASE: _body(spec.worldbody, _GROUPS[BASE], (0.0, 0.0, 0.0))}
    chain = (
        (COLUMN, BASE, (0.0, 0.0, geometry.height), hinge),
        (UPPER_ARM, COLUMN, (0.0, 0.0, 0.0), slide),
        (FOREARM, UPPER_ARM, (geometry.upper_arm, 0.0, 0.0), hinge),
        (WRIST, FOREARM, (geometry.forearm, 0.0, 0.0), hinge),
    )
    for number, (frame, parent, place, kind) in enumerate(chain):
        made[frame] = _body(made[parent], _GROUPS[frame], place)
        made[frame].add_joint(name=f"j{number + 1}", type=kind, axis=up, armature=inertias[number])
    for frame, side in ((LEFT_JAW, 1.0), (RIGHT_JAW, -1.0)):
        made[frame] = _body(made[WRIST], _GROUPS[frame], (0.0, 0.0, 0.0))
        # Its coordinate is half the width between the jaws.
        joint = made[frame].add_joint(
            name=_GROUPS[frame], type=slide, axis=[0.0, side, 0.0], armature=JAW_INERTIA,
            range=[jaws.lower / 2.0, jaws.upper / 2.0], limited=True, frictionloss=JAW_FRICTION,
        )  # fmt: skip
        damp(joint, JAW_DAMPING)
    for body in (*links_of(geometry), *GRIPPER):
        _add_shapes(made[body.frame], body)
    for one, other in ((BASE, COLUMN), (LEFT_JAW, RIGHT_JAW)):
        spec.add_exclude(bodyname1=_GROUPS[one], bodyname2=_GROUPS[other])
    equal = spec.add_equality(
        type=engine.mjtEq.mjEQ_JOINT, objtype=engine.mjtObj.mjOBJ_JOINT, name1=RIGHT, name2=LEFT,
        solref=[0.004, 1.0],
    )  # fmt: skip
    equal.data[:2] = 0.0, 1.0
    servo = spec.add_actuator(
        name="servo", target=LEFT, trntype=engine.mjtTrn.mjTRN_JOINT, forcelimited=True,
        forcerange=[-1.0, 1.0],
    )  # fmt: skip
    servo.gaintype, servo.biastype = engine.mjtGain.mjGAIN_FIXED, engine.mjtBias.mjBIAS_AFFINE
    servo.gainprm[0], servo.biasprm[1] = STIFFNESS, -STIFFNESS


def geoms_of(shape: Prism | Upright) -> Iterator[tuple[bool, tuple[float, ...], tuple[float, ...]]]:
    """Yield the boxes and cylinders whose union is an upright shape of no rotation.

    Args:
        shape: The shape.

    Returns:
        Whether it is a box or a cylinder; its centre [m]; its half sizes, or its radius and half
        its height [m].
    """
    x, y, r = shape.x, shape.y, shape.radius
    middle, half = (shape.low + shape.high) / 2.0, (shape.high - shape.low) / 2.0
    wide = {(shape.half_x + r, shape.half_y), (shape.half_x, shape.half_y + r)}
    for half_x, half_y in sorted(wide):
        if half_x > 0.0 and half_y > 0.0:
            yield True, (x, y, middle), (half_x, half_y, half)
    if r > 0.0:
        for px in sorted({x - shape.half_x, x + shape.half_x}):
            for py in sorted({y - shape.half_y, y + shape.half_y}):
                yield False, (px, py, middle), (r, half)


def jaw_boxes() -> dict[str, tuple[BodyBox, ...]]:
    """Return the boxes of each jaw, in its frame."""
    found: dict[str, tuple[BodyBox, ...]] = {}
    for body in GRIPPER:
        if body.frame in (LEFT_JAW, RIGHT_JAW):
            boxes = tuple(
                BodyBox(*centre, *sizes)
                for shape in body.shapes
                for _, centre, sizes in geoms_of(shape)
            )
            name = _GROUPS[body.frame]
            found[name] = (*found.get(name, ()), *boxes)
    return found


def _body(parent: Any, name: str, place: Sequence[float]) -> Any:
    return parent.add_body(
        name=name, pos=list(place), mass=LINK_MASS, inertia=[LINK_MASS] * 3, explicitinertial=True,
        gravcomp=1.0,
    )  # fmt: skip


def damp(joint: Any, damping: float) -> None:
    """Set the damping of a joint: a number before version 4, three since."""
    if isinstance(joint.damping, float):
        joint.damping = damping
    else:
        joint.damping[0] = damping


def _add_shapes(made: Any, body: Body) -> None:
    engine = mujoco()
    jaw = body.frame in (LEFT_JAW, RIGHT_JAW)
    for shape in body.shapes:
        for is_box, centre, sizes in geoms_of(shape):
            geom = made.add_geom(
                type=engine.mjtGeom.mjGEOM_BOX if is_box else engine.mjtGeom.mjGEOM_CYLINDER,
                pos=list(centre), size=[*sizes, 0.0][:3], mass=0.0, contype=ARM,
                conaffinity=ARM | OTHERS, rgba=list(COLOURS["jaw" if jaw else "arm"]),
            )  # fmt: skip
            if jaw:
                # Friction of a pair is the larger of both otherwise.
                geom.priority, geom.friction = 1, list(PAD_FRICTION)
            if jaw and shape.half_y < _THIN:
                geom.priority, geom.solref = 2, list(PAD_SOLREF)
