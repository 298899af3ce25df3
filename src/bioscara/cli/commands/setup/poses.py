"""``bioscara poses``."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bioscara.cli.arm_choice import BUS_HELP
from bioscara.cli.output.console import Output, columns
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import JOINTS, share, share_scene, share_taught
from bioscara.errors import InvalidArgumentError, NotHomedError, UnreachableError

if TYPE_CHECKING:
    from bioscara.cli.output.angles import AngleUnit
    from bioscara.cli.teach_table import TableStore
    from bioscara.kinematics import Joints, Pose, Scara
    from bioscara.model import ArmParameters
    from bioscara.robot.workspace.poses import NamedPose


def arguments(parser: Parser) -> None:
    parser.take_commands("action", "ACTION")
    listing = parser.add_command("list", "List all poses and tools.")
    show = parser.add_command("show", "Show one pose, and whether the arm can take it.")
    save = parser.add_command("save", "Save a pose under a name.")
    delete = parser.add_command("delete", "Delete a saved pose.")
    for action in (listing, show, save, delete):
        share(action, "--parameters")
        if action is not listing:
            action.add_argument("name", metavar="NAME", help="name of the pose")
        share_taught(action)
    share(
        show,
        "--plot",
        help="draw the motion to the pose, joints and tool against their limits, as PNG",
    )
    share(show, "--from", help="joint positions at the start of that motion")
    share_scene(show, help="file with the zones and the table that the motion keeps clear of")
    show.checks.append(_check_show)
    where = save.add_mutually_exclusive_group()
    where.add_argument("--bus", metavar="BUS", help="current position of this arm; " + BUS_HELP)
    share(where, "--joints", help="joint positions [rad m rad rad]")
    share(where, "--pose", help="pose of the tool in the base [m m m rad]")
    share(save, "--tool", help="name of the tool")
    save.add_argument(
        "--calibration",
        metavar="ID",
        default="",
        help="identifier of the calibration of the arm, stored with the pose",
    )
    share(save, "--force", help="replace the pose of this name, if there is one")
    save.checks.append(_check_save)


def _check_show(parser: Parser, options: Options) -> None:
    given = {"--from": options.start, "--scene": options.scene, "--world": options.world}
    for word, value in given.items():
        if value is not None and options.plot is None:
            parser.error(f"{word} applies only to the motion that --plot FILE draws; add --plot")


def _check_save(parser: Parser, options: Options) -> None:
    if options.bus and options.arm:
        parser.error("--arm and --bus exclude one another; leave out one of them")
    if not (options.bus or options.arm or options.joints or options.pose):
        parser.error(
            "poses save needs one of --arm NAME or --bus BUS for the position of that arm, "
            f"--joints {' '.join(JOINTS)}, --pose X Y Z YAW"
        )


def run(options: Options, output: Output) -> None:
    """List, show, save or delete poses; nothing moves.

    Raises:
        InvalidArgumentError: There is no such pose or tool, or the arm cannot reach the pose.
        ConfigurationError: The file cannot be read or written.
    """
    from bioscara.cli.teach_table import table_store
    from bioscara.robot.workspace.poses import BUILT_IN

    action = options.action
    actions = {"list": _list, "show": _show, "save": _save, "delete": _delete}
    # The message that a pose is built in takes precedence over that of a missing file.
    built_in = action == "delete" and any(pose.name == options.name for pose in BUILT_IN)
    with table_store(
        options, changes=action in {"save", "delete"}, create=action == "save" or built_in
    ) as store:
        lines = actions[action](options, store)
    output.lines(lines)


def _list(options: Options, store: TableStore) -> list[str]:
    from bioscara.cli.output.angles import angle_unit
    from bioscara.cli.teach_table import table_file, tool_rows

    table, angles = store.table, angle_unit(options)
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
    if options.arm is None and not table_file(options).exists():
        lines += ["", f"{table_file(options)} does not exist: these are what every arm has"]
    return lines


def _show(options: Options, store: TableStore) -> list[str]:
    from bioscara.cli.output.angles import angle_unit
    from bioscara.cli.output.plots import require_drawing
    from bioscara.cli.teach_table import lookup
    from bioscara.robot.workspace.poses import BUILT_IN
    from bioscara.robot.workspace.tools import kinematics_with

    require_drawing(options.plot)
    table, parameters = store.table, store.parameters
    pose = lookup(options, table.pose, options.name)
    tool = table.tool(pose.tool)
    arm = kinematics_with(parameters, tool)
    lines = [f"pose {pose.name}, {'built in' if pose in BUILT_IN else f'from {store.where}'}"]
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
        lines += [_drawn(pose, options, store)]
    return lines


def _drawn(pose: NamedPose, options: Options, store: TableStore) -> str:
    """Draw the motion to a pose; return a message that names the file.

    Raises:
        InvalidArgumentError: The arm cannot move there, or the file cannot be written.
    """
    from bioscara.cli.output.plots import write_picture
    from bioscara.cli.target import planner_from

    parameters = store.parameters
    planner = planner_from(options, parameters)
    planner.workspace = planner.workspace.with_table(store.table).with_tool(pose.tool)
    plan = planner.move_named(pose.name)
    return write_picture(options.plot, plan, planner, parameters, f"pose {pose.name}")


def _reached(kinematics: Scara, place: Pose) -> tuple[Joints | None, str]:
    """Return the joint solution closest to the centre of the limits, or why there is none."""
    from bioscara.kinematics import Joints

    centre = Joints(*(0.5 * (limit.lower + limit.upper) for limit in kinematics.limits))
    try:
        return kinematics.solve(place, centre), ""
    except UnreachableError as error:
        return None, str(error)


def _save(options: Options, store: TableStore) -> list[str]:
    from bioscara.cli.teach_table import lookup, refuse_overwriting
    from bioscara.kinematics import Joints, Pose
    from bioscara.robot.workspace.poses import NamedPose
    from bioscara.robot.workspace.tools import kinematics_with

    table, parameters = store.table, store.parameters
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
    refuse_overwriting("pose", pose.name, table.poses, store, options)
    store.save(table.with_pose(pose, overwrite=options.force))
    return [f"saved {options.name} to {store.where}: tool {options.tool} at {place}"]


def _delete(options: Options, store: TableStore) -> list[str]:
    store.save(store.table.without_pose(options.name))
    return [f"deleted {options.name} from {store.where}"]


def _here(options: Options, parameters: ArmParameters) -> Joints:
    """Return the joint positions of the arm.

    Raises:
        InvalidArgumentError: The arm is not homed.
    """
    from bioscara.cli.opened_arm import open_arm

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
