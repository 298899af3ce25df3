"""``bioscara poses``."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.opened_arm import open_arm
from bioscara.cli.options import Options
from bioscara.cli.output.angles import AngleUnit, angle_unit
from bioscara.cli.output.console import ExitStatus, Output, columns
from bioscara.cli.output.plots import require_drawing, write_picture
from bioscara.cli.target import planner_from
from bioscara.cli.teach_table import lookup, read_table, refuse_overwriting, table_file, tool_rows
from bioscara.errors import InvalidArgumentError, NotHomedError, UnreachableError
from bioscara.kinematics import Joints, Pose, Scara
from bioscara.model import ArmParameters
from bioscara.robot.workspace.poses import BUILT_IN, NamedPose
from bioscara.robot.workspace.teach_file import changing, load_table, save_table
from bioscara.robot.workspace.tools import fingers, kinematics_with


def run(options: Options) -> int:
    """List, show, save or delete poses; nothing moves.

    Raises:
        InvalidArgumentError: There is no such pose or tool, or the arm cannot reach the pose.
        ConfigurationError: The file cannot be read or written.
        BioscaraError: The arm's position cannot be read.
        OSError: Standard output cannot be written.
    """
    output, parameters = Output(), parameters_from(options)
    actions = {"list": _list, "show": _show, "save": _save, "delete": _delete}
    with changing(table_file(options)) if options.action in {"save", "delete"} else nullcontext():
        lines = actions[options.action](options, parameters)
    for line in lines:
        output.line(line)
    output.check()
    return ExitStatus.OK


def _list(options: Options, parameters: ArmParameters) -> list[str]:
    table, angles = read_table(options, fingers(parameters)), angle_unit(options)
    poses = [("pose", *_headings(angles), "tool", "calibration")]
    poses += [
        (
            pose.name,
            _numbers(pose.joints, angles),
            _numbers(pose.pose_tool_in_base, angles),
            pose.tool,
            pose.calibration or "-",
        )
        for pose in table.all_poses()
    ]
    lines = [*columns(poses), "", *columns(tool_rows(table, angles))]
    if not table_file(options).exists():
        lines += ["", f"{table_file(options)} does not exist: these are what every arm has"]
    return lines


def _show(options: Options, parameters: ArmParameters) -> list[str]:
    require_drawing(options.plot)
    table = read_table(options, fingers(parameters))
    pose = lookup(options, table.pose, options.name)
    tool = table.tool(pose.tool)
    arm = kinematics_with(parameters, tool)
    lines = [
        f"pose {pose.name}, {'built in' if pose in BUILT_IN else f'from {table_file(options)}'}"
    ]
    joints, place, problem = pose.joints, pose.pose_tool_in_base, ""
    if joints is not None:
        place, problem = arm.forward(joints), "; ".join(arm.beyond(joints))
    elif place is not None:
        joints, problem = _reached(arm, place)
    angles = angle_unit(options)
    of_joints, of_tool = _headings(angles)
    if pose.joints is None:
        of_joints = f"one solution, {of_joints}"
    rows = [
        (of_joints, _numbers(joints, angles)),
        (of_tool, _numbers(place, angles)),
        ("tool", f"{tool.name}, {tool.mass:g} kg"),
        ("calibration", pose.calibration or "-"),
        ("reachable", "yes" if not problem else f"no: {problem}"),
    ]
    lines += [f"  {line}" for line in columns(rows)]
    if options.plot is not None:
        lines += [_drawn(options.plot, pose, options, parameters)]
    return lines


def _drawn(path: Path, pose: NamedPose, options: Options, parameters: ArmParameters) -> str:
    """Draw the motion to a pose; return a message that names the file.

    Raises:
        InvalidArgumentError: The arm cannot move there, or the file cannot be written.
    """
    planner = planner_from(options, parameters)
    planner.workspace = planner.workspace.with_tool(pose.tool)
    plan = planner.move_named(pose.name)
    return write_picture(path, plan, planner, parameters, f"pose {pose.name}")


def _reached(arm: Scara, place: Pose) -> tuple[Joints | None, str]:
    """Return the joint solution closest to the centre of the limits, or why there is none."""
    centre = Joints(*(0.5 * (limit.lower + limit.upper) for limit in arm.limits))
    try:
        return arm.solve(place, centre), ""
    except UnreachableError as error:
        return None, str(error)


def _save(options: Options, parameters: ArmParameters) -> list[str]:
    table = read_table(options, fingers(parameters), create=True)
    arm = kinematics_with(parameters, lookup(options, table.tool, options.tool))
    joints, place, problem = None, None, ""
    if options.pose is not None:
        place = Pose(*options.pose)
    else:
        joints = _here(options, parameters) if options.joints is None else Joints(*options.joints)
    pose = NamedPose(options.name, joints, place, options.tool, options.calibration)
    if joints is not None:
        place, problem = arm.forward(joints), "; ".join(arm.beyond(joints))
        pose = replace(pose, pose_tool_in_base=place)
    elif place is not None:
        problem = _reached(arm, place)[1]
    if problem:
        raise InvalidArgumentError(f"pose {options.name} is not saved: {problem}")
    refuse_overwriting("pose", pose.name, table.poses, options)
    save_table(table_file(options), table.with_pose(pose, overwrite=options.force))
    return [f"saved {options.name} to {table_file(options)}: tool {options.tool} at {place}"]


def _delete(options: Options, parameters: ArmParameters) -> list[str]:
    built_in = any(pose.name == options.name for pose in BUILT_IN)
    # The message that a pose is built in takes precedence over that of a missing file.
    table = (
        read_table(options, fingers(parameters), create=True)
        if built_in
        else load_table(table_file(options), fingers(parameters))
    )
    save_table(table_file(options), table.without_pose(options.name))
    return [f"deleted {options.name} from {table_file(options)}"]


def _here(options: Options, parameters: ArmParameters) -> Joints:
    """Return the joint positions of the arm.

    Raises:
        InvalidArgumentError: The arm is not homed.
    """
    with open_arm(options, parameters) as robot:
        try:
            return robot.plan.here()
        except NotHomedError as error:
            raise InvalidArgumentError(
                f"pose {options.name} is not saved: {error.joint} is not homed, so it does not "
                "know where it is; 'bioscara home' homes the arm"
            ) from error


def _headings(angles: AngleUnit) -> tuple[str, str]:
    name = angles.name
    return f"joints [{name} m {name} {name}]", f"tool at [m m m {name}]"


def _numbers(values: Joints | Pose | None, angles: AngleUnit) -> str:
    return "-" if values is None else angles.numbers(values)
