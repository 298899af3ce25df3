"""Target, start and scene of ``bioscara plan`` and ``bioscara move``."""

from __future__ import annotations

import math

from bioscara.cli.arguments import Options
from bioscara.cli.shared_arguments import START
from bioscara.cli.target_checks import check_target
from bioscara.cli.taught_table import by_name, taught
from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Pose, Scara, batch
from bioscara.model import ArmParameters
from bioscara.planning.collision.scene import Scene
from bioscara.planning.files.scene_file import read_scene
from bioscara.planning.motions.tool_speed import peak_tool_speed
from bioscara.planning.trajectory.extrema import joint_extrema
from bioscara.robot.planner import Plan, Planner


def wanted_scene(options: Options) -> Scene:
    """Return the scene of ``--scene``; an empty one if no file is given.

    Raises:
        ConfigurationError: The file cannot be read; names file and line.
    """
    return Scene() if options.scene is None else read_scene(options.scene)


def planner_from(options: Options, parameters: ArmParameters) -> Planner:
    """Return a planner that starts at ``--from``, with the poses and the scene of their files.

    Raises:
        InvalidArgumentError: The start is outside the limits, or a file cannot be read.
    """
    start = START if options.start is None else options.start
    planner = Planner(parameters, lambda: start)
    problems = planner.kinematics.beyond(start)
    if problems:
        raise InvalidArgumentError(f"--from is outside the limits: {'; '.join(problems)}")
    planner.table = taught(options, planner.tool)
    planner.scene = wanted_scene(options)
    return planner


def target_planner(options: Options, parameters: ArmParameters) -> Planner:
    """Return a planner as :func:`planner_from`, with ``--tool``, after a check of the target.

    Raises:
        InvalidArgumentError: The target is refused irrespective of the arm's position, or there is
            no such tool.
    """
    planner = planner_from(options, parameters)
    by_name(options, planner.use_tool, options.tool)
    check_target(planner, options)
    return planner


def plan_target(planner: Planner, options: Options) -> Plan:
    """Return the motion to the target that the options name; nothing moves.

    Args:
        planner: Planner at the arm's position, with table, scene and tool of the planner that
            :func:`target_planner` returned.
        options: Parsed options, checked by :func:`target_planner`.

    Raises:
        UnreachableError, TrajectoryError, ZoneError: The arm cannot move to the target.
    """
    planner.full_speed = options.full_speed
    if options.name:
        return planner.named(options.name, options.speed)
    if options.joints is not None:
        return planner.joints(options.joints, options.speed)
    pose = Pose(*options.pose or ())
    if options.via is not None:
        x, y, z = options.via
        return planner.circular(Pose(x, y, z, pose.yaw), pose, options.speed)
    if options.linear:
        return planner.linear(pose, options.speed)
    return planner.to(pose, options.speed)


def describe(plan: Plan, arm: Scara) -> list[str]:
    """Describe a plan for the user, one item per line."""
    trajectory = plan.trajectory
    ends = batch.forward(arm, trajectory.positions[[0, -1]])
    peak = peak_tool_speed(trajectory, arm, (0.0,) * len(arm.limits))
    lines = [
        f"duration {trajectory.duration:.3f} s, tool at most {1e3 * peak:.0f} mm/s",
        *(
            f"{word} ({x:z.4f}, {y:z.4f}, {z:z.4f}) m, yaw {math.degrees(yaw):z.1f} deg"
            for word, (x, y, z, yaw) in zip(("from", "to  "), ends.tolist(), strict=True)
        ),
    ]
    for limit, ranges, goal in zip(
        arm.limits, joint_extrema(trajectory), trajectory.positions[-1].tolist(), strict=True
    ):
        unit = limit.unit
        lines.append(
            f"{limit.name} to {goal:+z.4f} {unit}, at most "
            f"{abs(ranges.velocity.largest.value):.4f} {unit}/s and "
            f"{abs(ranges.acceleration.largest.value):.4f} {unit}/s^2"
        )
    return [*lines, *(f"note: {note}" for note in plan.notes)]
