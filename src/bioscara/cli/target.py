"""The target, start and scene of ``bioscara plan`` and ``bioscara move``.

A target is checked as far as possible before homing or enabling, irrespective of the arm's
position, and planned from there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bioscara.cli.opened_arm import arrange
from bioscara.cli.output.angles import LENGTHS, AngleUnit
from bioscara.cli.parser import Options
from bioscara.cli.shared_arguments import START
from bioscara.cli.teach_table import lookup, read_table
from bioscara.errors import InvalidArgumentError, UnreachableError, ZoneError
from bioscara.kinematics import Joints, Pose, Scara, batch
from bioscara.kinematics.pose import ANGLE_MAX, PLACE_MAX
from bioscara.model import ArmParameters
from bioscara.planning.collision.margins import GOAL_SLACK
from bioscara.planning.collision.scene import Scene
from bioscara.planning.files.scene_file import read_scene
from bioscara.planning.limits import check_share
from bioscara.planning.motions.tool_speed import peak_tool_speed
from bioscara.planning.trajectory.extrema import joint_extrema
from bioscara.robot.arm_methods import ArmMethods
from bioscara.robot.planner import Plan, Planner
from bioscara.robot.workspace.tools import check_number
from bioscara.robot.workspace.workspace import Workspace


def scene_from(options: Options) -> Scene:
    """Return the scene of ``--scene`` or ``--world``; an empty one if no file is given.

    Raises:
        ConfigurationError: The file cannot be read; names file and line.
    """
    if options.world is not None:
        # Imported here: few commands have a world.
        from bioscara.planning.world import read_world  # noqa: PLC0415

        return read_world(options.world).planned
    return Scene() if options.scene is None else read_scene(options.scene)


def arrange_owned(robot: ArmMethods, options: Options) -> None:
    """Give the arm of an owner the table, the scene and the tool that options name, if any."""
    table = read_table(options, robot.table.fingers) if options.table else robot.table
    arrange(robot, options, table, scene_from(options), options.tool)


def planner_from(options: Options, parameters: ArmParameters) -> Planner:
    """Return a planner that starts at ``--from``, with the poses and the scene of their files.

    Raises:
        InvalidArgumentError: The start is outside the limits, or a file cannot be read.
    """
    start = START if options.start is None else options.start
    workspace = Workspace.of(parameters, reduced_speed=not options.full_speed)
    problems = workspace.kinematics.beyond(start)
    if problems:
        raise InvalidArgumentError(f"--from is outside the limits: {'; '.join(problems)}")
    workspace = workspace.with_table(read_table(options, workspace.tool))
    return Planner(workspace.with_scene(scene_from(options)), lambda: start)


def target_planner(options: Options, parameters: ArmParameters) -> Planner:
    """Return a planner as :func:`planner_from`, with ``--tool``, after a check of the target.

    Raises:
        InvalidArgumentError: The target is refused irrespective of the arm's position, or there is
            no such tool.
    """
    planner = planner_from(options, parameters)
    planner.workspace = lookup(options, planner.workspace.with_tool, options.tool)
    check_target(planner, options)
    return planner


def plan_target(planner: Planner, options: Options) -> Plan:
    """Return the motion to the target that the options name; nothing moves.

    Args:
        planner: Planner at the arm's position, in the workspace of the planner that
            :func:`target_planner` returned.
        options: Parsed options, checked by :func:`target_planner`.

    Raises:
        UnreachableError, TrajectoryError, ZoneError: The arm cannot move to the target.
    """
    share = options.velocity_scaling
    if options.name:
        return planner.move_named(options.name, velocity_scaling=share)
    if options.joints is not None:
        return planner.move_joints(options.joints, velocity_scaling=share)
    pose = Pose(*options.pose or ())
    if options.via is not None:
        x, y, z = options.via
        return planner.move_circular(Pose(x, y, z, pose.yaw), pose, velocity_scaling=share)
    if options.linear:
        return planner.move_linear(pose, velocity_scaling=share)
    return planner.move_to(pose, velocity_scaling=share)


def describe(plan: Plan, kinematics: Scara, angles: AngleUnit) -> list[str]:
    """Describe a plan for the user, one item per line."""
    trajectory = plan.trajectory
    ends = batch.forward(kinematics, trajectory.positions[[0, -1]])
    peak = peak_tool_speed(trajectory, kinematics, (0.0,) * len(kinematics.limits))
    lines = [
        f"duration {trajectory.duration:.3f} s, tool at most {1e3 * peak:.0f} mm/s",
        *(
            f"{word} ({x:z.4f}, {y:z.4f}, {z:z.4f}) m, yaw {math.degrees(yaw):z.1f} deg"
            for word, (x, y, z, yaw) in zip(("from", "to  "), ends.tolist(), strict=True)
        ),
    ]
    for limit, ranges, goal in zip(
        kinematics.limits, joint_extrema(trajectory), trajectory.positions[-1].tolist(), strict=True
    ):
        unit = limit.unit
        lines.append(
            f"{limit.name} to {angles.quantity(goal, unit)}, at most "
            f"{angles.quantity(abs(ranges.velocity.largest.value), unit, '/s', sign='')} and "
            f"{angles.quantity(abs(ranges.acceleration.largest.value), unit, '/s^2', sign='')}"
        )
    return [*lines, *(f"note: {note}" for note in plan.notes)]


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
    _check_options(options)
    arm = planner.kinematics
    if options.via is not None:
        _check_via(arm, options.via)
    solutions = _solutions(planner, options)
    refusals = [_refusal(planner.workspace.scene, arm, joints) for joints in solutions]
    found = [refusal for refusal in refusals if refusal is not None]
    if len(found) == len(solutions):
        raise min(found, key=lambda refusal: refusal.depth)


def _check_options(options: Options) -> None:
    check_share(options.velocity_scaling, "--velocity-scaling")
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
        size, unit = (PLACE_MAX, "m") if field in LENGTHS else (ANGLE_MAX, "rad")
        try:
            check_number(f"{word}, {field}", value, size, unit)
        except InvalidArgumentError as error:
            hint = " --deg takes them" if str(error).endswith("degrees?") else ""
            raise InvalidArgumentError(f"{error}{hint}") from error


def _check_via(kinematics: Scara, via: Sequence[float]) -> None:
    """Refuse a point that the tool cannot reach with any yaw."""
    x, y, z = via
    tool, built = kinematics.tool, kinematics.geometry
    reach = built.upper_arm + built.forearm + math.hypot(tool.x, tool.y)
    over = math.hypot(x, y) - reach
    if over > _ROUNDING:
        raise UnreachableError(
            f"--via cannot be reached: it is {over:.4f} m beyond the tool's reach of {reach:.4f} m"
        )
    lift = z - tool.z - built.height
    problems = kinematics.beyond(Joints(*_middle(kinematics))._replace(j2=lift))
    if problems:
        raise UnreachableError(f"--via cannot be reached: it would take {problems[0]}")


def _solutions(planner: Planner, options: Options) -> list[Joints]:
    """Return all joint solutions for the target that are within the limits."""
    arm = planner.kinematics
    joints = None if options.joints is None else Joints(*options.joints)
    place = None if options.pose is None else Pose(*options.pose)
    word = "--joints"
    if options.name:
        word = f"pose {options.name}"
        taught = lookup(options, planner.workspace.table.pose, options.name)
        joints, place = taught.joints, taught.pose_tool_in_base
        mounted = planner.workspace.tool.name
        if joints is None and taught.tool != mounted:
            raise InvalidArgumentError(
                f"{word} was taught with tool {taught.tool}, the arm has {mounted}; "
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


def _middle(kinematics: Scara) -> list[float]:
    return [0.5 * (limit.lower + limit.upper) for limit in kinematics.limits]


def _refusal(scene: Scene, kinematics: Scara, joints: Joints) -> ZoneError | None:
    """Return the error for joint positions without clearance; None if they are free."""
    layout = scene.layout(kinematics)
    if not layout.pairs:
        return None
    pairs = layout.clearances(kinematics, np.array([joints]), scene.margin)[:, 0]
    nearest = int(pairs.argmin())
    pair, missed = layout.pairs[nearest], scene.margin - float(pairs[nearest])
    # An arm that is there already may have a slightly smaller clearance.
    if missed <= GOAL_SLACK:
        return None
    margin = scene.margin - pair.allowed
    return ZoneError(pair.zone, pair.link, math.nan, missed, margin, "at the target", at_goal=True)
