"""Distances between the links of the arm: pinocchio places them, coal measures.

Nothing of ``bioscara`` decides here but the files of the description.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from itertools import combinations, pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from bioscara.model.urdf import DESCRIPTION, URDF
from bioscara.planning.collision.shapes import Prism

Array = npt.NDArray[np.float64]
HAND = ("grp_base_link", "left_jaw_link", "right_jaw_link")
LINKS = ("base_link", "link_1", "link_2", "link_3", "link_4", *HAND)
NAMES = {"grp_base_link": "gripper", "left_jaw_link": "jaws", "right_jaw_link": "jaws"}
"""Planning's names of the links, where they differ."""
_JOINED = {frozenset(pair) for pair in (*pairwise(LINKS[:5]), *combinations(("link_4", *HAND), 2))}
"""Pairs of links that are in each other or next to each other by construction."""


@cache
def _loaded() -> tuple[Any, Any, dict[str, list[Any]]]:
    """Return model, its data and the convex parts of each link."""
    model = pin.buildModelFromUrdf(str(URDF))
    with TemporaryDirectory() as folder:
        for package in ("bioscara_arm_description", "bioscara_gripper_descriptions"):
            (Path(folder) / package).symlink_to(DESCRIPTION)
        found = pin.buildGeomFromUrdf(
            model, str(URDF), pin.GeometryType.COLLISION, package_dirs=[folder]
        )
    parts: dict[str, list[Any]] = {name: [] for name in LINKS}
    for body in found.geometryObjects:
        body.geometry.buildConvexRepresentation(False)
        parts[model.frames[body.parentFrame].name].append(body.geometry.convex)
    return model, model.createData(), parts


def parts_of(link: str) -> list[Any]:
    """Return the convex parts of a link, for coal, in its frame."""
    return _loaded()[2][link]


def places(joints: Sequence[float], width: float) -> dict[str, Any]:
    """Return the poses of the links, by name.

    Args:
        joints: j1 to j4 [rad, m, rad, rad].
        width: Between the jaws [m].
    """
    model, data, _ = _loaded()
    q = pin.neutral(model)
    at = dict(zip(("j1", "j2", "j3", "j4"), joints, strict=True))
    at |= {"gripper": width, "gripper_l_mimic": 0.5 * width, "gripper_r_mimic": -0.5 * width}
    for name, value in at.items():
        q[model.joints[model.getJointId(name)].idx_q] = value
    pin.framesForwardKinematics(model, data, q)
    return {name: data.oMf[model.getFrameId(name)].copy() for name in LINKS}


def gaps(
    joints: Sequence[float],
    width: float,
    load: Prism | None = None,
    far: float = np.inf,
) -> dict[tuple[str, str], float]:
    """Return the distances between links that are not joined, by their names in planning [m].

    Args:
        joints: j1 to j4 [rad, m, rad, rad].
        width: Between the jaws [m].
        load: A box that the gripper holds, in the frame of the wrist.
        far: Pairs that are farther apart may be left out [m].
    """
    at, bodies = places(joints, width), {name: parts_of(name) for name in LINKS}
    pairs = [pair for pair in combinations(LINKS, 2) if frozenset(pair) not in _JOINED]
    if load is not None:
        bodies["load"] = [coal.Box(2.0 * load.half_x, 2.0 * load.half_y, load.high - load.low)]
        turned = pin.SE3(
            pin.rpy.rpyToMatrix(0.0, 0.0, load.yaw),
            np.array((load.x, load.y, (load.low + load.high) / 2.0)),
        )
        at["load"] = at["link_4"] * turned
        pairs += [(link, "load") for link in LINKS[:4]]
    found: dict[tuple[str, str], float] = {}
    for one, other in pairs:
        gap = _between(bodies[one], at[one], bodies[other], at[other])
        names = NAMES.get(one, one), NAMES.get(other, other)
        if gap < far:
            found[names] = min(gap, found.get(names, np.inf))
    return found


def _between(ones: Iterable[Any], here: Any, others: Sequence[Any], there: Any) -> float:
    request, near = coal.DistanceRequest(), np.inf
    one = coal.Transform3s(here.rotation, here.translation)
    other = coal.Transform3s(there.rotation, there.translation)
    for part in ones:
        for against in others:
            result = coal.DistanceResult()
            near = min(near, coal.distance(part, one, against, other, request, result))
    return float(near)
