"""The clearance of an arm, from the messages of its owner."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from bioscara.api import messages as m
from bioscara.api.values import workspace_of
from bioscara.kinematics import Scara
from bioscara.model import ArmParameters
from bioscara.planning.collision.scene import Scene

Point = tuple[float, float, float]


class Clearance(msgspec.Struct, frozen=True):
    """The two bodies with the least clearance.

    Attributes:
        distance: Their distance [m], negative for a penetration; null where it is unknown, as on
            an arm that is not homed, or where there is nothing to collide with.
        link: Name of the link; empty where the distance is unknown.
        other: Its counterpart: a zone, the table or a link.
        link_point: The point of the link that is nearest, in the base frame [m]; null for a keep-in
            zone.
        other_point: The point of its counterpart.
        margin: Smallest distance that a motion may leave [m].
    """

    distance: float | None
    link: str
    other: str
    link_point: Point | None
    other_point: Point | None
    margin: float


def clearance(
    parameters: ArmParameters, workspace: m.WorkspaceState, joints: Sequence[float | None]
) -> Clearance:
    """Return the clearance of an arm.

    Args:
        parameters: Parameters of the arm.
        workspace: Its tool, scene and load.
        joints: j1 to j4 [rad, m, rad, rad]; None where a position is unknown.

    Raises:
        ConfigurationError: The scene is invalid.
    """
    arm, scene = surroundings(parameters, workspace)
    known = [value for value in joints if value is not None]
    found = scene.nearest_points(arm, known) if len(known) == len(parameters.joints) else None
    if found is None:
        return Clearance(None, "", "", None, None, scene.margin)
    pair, points = found
    one, other = points or (None, None)
    return Clearance(pair.distance, pair.link, pair.other, one, other, pair.margin)


def surroundings(parameters: ArmParameters, workspace: m.WorkspaceState) -> tuple[Scara, Scene]:
    """Return the kinematics of an arm with its tool, and its scene with its load.

    Raises:
        ConfigurationError: The scene is invalid.
    """
    space = workspace_of(parameters, workspace)
    return space.kinematics, space.surroundings
