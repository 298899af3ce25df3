"""``bioscara poses``."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from bioscara.cli.arguments import Options
from bioscara.cli.arm import open_arm
from bioscara.cli.output.console import ExitStatus, Output, columns
from bioscara.cli.output.plots import require_drawing, write_picture
from bioscara.cli.parameters import parameters_from
from bioscara.cli.target import planner_from
from bioscara.cli.teach_table import lookup, read_table, table_file
from bioscara.errors import InvalidArgumentError, NotHomedError, UnreachableError
from bioscara.kinematics import Joints, Pose, Scara
from bioscara.model import ArmParameters
from bioscara.robot.workspace.poses import BUILT_IN, NamedPose
from bioscara.robot.workspace.teach_file import changing, load_table, save_table
from bioscara.robot.workspace.tools import fingers, kinematics_with

_JOINTS = "joints [rad m rad rad]"
_PLACE = "tool at [m m m rad]"


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
    table = read_table(options, fingers(parameters))
    poses = [("pose", _JOINTS, _PLACE, "tool", "calibration")]
    poses += [
        (
            pose.name,
            _numbers(pose.joints),
            _numbers(pose.pose_tool_in_base),
            pose.tool,
            pose.calibration or "-",
        )
        for pose in table.all_poses()
    ]
    tools = [("tool", "offset in the flange [m m m rad]", "mass [kg]")]
    tools += [
        (tool.name, _numbers(tool.pose_tool_in_flange), f"{tool.mass:g}")
        for tool in table.all_tools()
    ]
    lines = [*columns(poses), "", *columns(tools)]
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
    rows = [
        (_JOINTS if pose.joints is not None else f"one solution, {_JOINTS}", _numbers(joints)),
        (_PLACE, _numbers(place)),
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
    changed = table.with_pose(pose)
    save_table(table_file(options), changed)
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
                "know where it is; 'bioscara move --name center' homes the arm, and moves it"
            ) from error


def _numbers(values: Joints | Pose | None) -> str:
    return "-" if values is None else " ".join(f"{value:+z.4f}" for value in values)
