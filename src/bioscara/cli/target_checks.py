"""Checks of a target that do not depend on the arm's position: done before homing or enabling."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bioscara.cli.arguments import Options
from bioscara.cli.taught_table import by_name
from bioscara.errors import InvalidArgumentError, UnreachableError, ZoneError
from bioscara.kinematics import Joints, Pose, Scara
from bioscara.kinematics.pose import ANGLE_MAX, PLACE_MAX
from bioscara.planning.collision.goal_slack import STAND
from bioscara.planning.collision.scene import Scene
from bioscara.planning.limits import check_share
from bioscara.robot.planner import Planner
from bioscara.robot.workspace.tools import check_number

_LENGTHS = ("j2", "x", "y", "z")
_ROUNDING = 1e-9
"""Tolerance of the reach for rounding errors [m]."""


def check_target(planner: Planner, options: Options) -> None:
    """Refuse a target that cannot be reached from any position.

    Args:
        planner: Planner of the arm, with the mounted tool.
        options: Parsed options.

    Raises:
        InvalidArgumentError: The options exclude one another, a number is not possible, the target
            is out of reach, outside the limits or in a zone, or its pose was taught with another
            tool.
    """
    _check_words(options)
    arm = planner.kinematics
    if options.via is not None:
        _check_via(arm, options.via)
    ways = _ways(planner, options)
    refusals = [_refusal(planner.scene, arm, joints) for joints in ways]
    found = [refusal for refusal in refusals if refusal is not None]
    if len(found) == len(ways):
        raise min(found, key=lambda refusal: refusal.depth)


def _check_words(options: Options) -> None:
    check_share(options.speed)
    if options.pose is None and (options.linear or options.via is not None):
        raise InvalidArgumentError("--linear and --via need a --pose to go to")
    if options.linear and options.via is not None:
        raise InvalidArgumentError("--linear and --via exclude one another")
    _check_sizes("--pose", Pose._fields, options.pose)
    _check_sizes("--joints", Joints._fields, options.joints)
    _check_sizes("--via", Pose._fields[:3], options.via)
    if options.pose is not None and options.via == options.pose[:3]:
        raise InvalidArgumentError("--via is where --pose is; an arc needs a place between")


def _check_sizes(word: str, fields: Sequence[str], values: Sequence[float] | None) -> None:
    """Refuse values that are not finite or, by their size, in millimetres or degrees."""
    for field, value in zip(fields, values or (), strict=values is not None):
        size, unit = (PLACE_MAX, "m") if field in _LENGTHS else (ANGLE_MAX, "rad")
        check_number(f"{word}, {field}", value, size, unit)


def _check_via(arm: Scara, via: Sequence[float]) -> None:
    """Refuse a point that the tool cannot reach with any yaw."""
    x, y, z = via
    tool, built = arm.tool, arm.geometry
    reach = built.upper_arm + built.forearm + math.hypot(tool.x, tool.y)
    over = math.hypot(x, y) - reach
    if over > _ROUNDING:
        raise UnreachableError(
            f"--via cannot be reached: it is {over:.4f} m beyond the tool's reach of {reach:.4f} m"
        )
    lift = z - tool.z - built.height
    problems = arm.beyond(Joints(*_middle(arm))._replace(j2=lift))
    if problems:
        raise UnreachableError(f"--via cannot be reached: it would take {problems[0]}")


def _ways(planner: Planner, options: Options) -> list[Joints]:
    """Return all joint solutions for the target that are within the limits."""
    arm = planner.kinematics
    joints = None if options.joints is None else Joints(*options.joints)
    place = None if options.pose is None else Pose(*options.pose)
    word = "--joints"
    if options.name:
        word = f"pose {options.name}"
        taught = by_name(options, planner.table.pose, options.name)
        joints, place = taught.joints, taught.pose_tool_in_base
        if joints is None and taught.tool != planner.tool.name:
            raise InvalidArgumentError(
                f"{word} was taught with tool {taught.tool}, the arm has {planner.tool.name}; "
                f"give --tool {taught.tool} once that is mounted"
            )
    if joints is not None:
        problems = arm.beyond(joints)
        if problems:
            raise InvalidArgumentError(f"{word}: {'; '.join(problems)}")
        return [joints]
    if place is None:
        raise InvalidArgumentError("give a target: --pose, --joints or --name")
    arm.solve(place, _middle(arm))
    return [each for each in arm.inverse(place) if not arm.beyond(each)]


def _middle(arm: Scara) -> list[float]:
    return [0.5 * (limit.lower + limit.upper) for limit in arm.limits]


def _refusal(scene: Scene, arm: Scara, joints: Joints) -> ZoneError | None:
    """Return the error for joint positions without clearance; None if they are free."""
    layout = scene.layout(arm)
    if not layout.pairs:
        return None
    pairs = layout.clearances(arm, np.array([joints]), scene.margin)[:, 0]
    nearest = int(pairs.argmin())
    pair, missed = layout.pairs[nearest], scene.margin - float(pairs[nearest])
    # An arm that is there already may have a slightly smaller clearance.
    if missed <= STAND:
        return None
    margin = scene.margin - pair.allowed
    return ZoneError(pair.zone, pair.link, math.nan, missed, margin, "at the target")
