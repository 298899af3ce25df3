"""Reading of ROS 2 messages with a joint trajectory, as YAML or JSON.

A trajectory_msgs/JointTrajectory, alone or within a message of MoveIt or the goal of an action, in
the format of ``ros2 topic echo``: comment lines, messages terminated by ``---``; as it is pasted
into ``ros2 action send_goal``; or as JSON.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TypeAlias

from bioscara.arguments import shown
from bioscara.errors import TrajectoryError
from bioscara.planning.files.pasted import message_in
from bioscara.planning.files.ros_json import is_json, json_document
from bioscara.planning.files.ros_message_parser import FULL_LENGTH, Document, Node, first_document
from bioscara.planning.trajectory.trajectory import Trajectory
from bioscara.spelling import did_you_mean

_Fields: TypeAlias = dict[str, Node]

_QUANTITIES = ("positions", "velocities", "accelerations")
_POINT = (*_QUANTITIES, "effort", "time_from_start")
_STAMP = ("sec", "nanosec")
_WITHIN = (
    "goal", "result", "motion_plan_response", "planned_trajectory", "solution", "trajectory",
    "joint_trajectory",
)  # fmt: skip
"""Fields in which messages have the trajectory, of the outer messages first."""
_MULTI_DOF = ("multi_dof_joint_trajectory", "multi_dof_trajectory")
_TOLERANCES = ("path_tolerance", "component_path_tolerance", "goal_tolerance",
               "component_goal_tolerance")  # fmt: skip
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")


def trajectory_of_message(text: str) -> tuple[Trajectory, tuple[str, ...]]:
    """Return the trajectory in the first message of ``text``, and notes.

    Raises:
        TrajectoryError: The text is not a message with a joint trajectory, or may be truncated.
    """
    text = message_in(text)
    document = json_document(text) if is_json(text) else first_document(text)
    if document.value is None:
        raise TrajectoryError("holds no message")
    if isinstance(document.value, str):
        raise TrajectoryError("holds words and no message; write it as 'ros2 topic echo' does")
    message, notes = _joint_trajectory(document.value)
    if document.more:
        notes.append("only the first of several messages is used")
    trajectory = _trajectory(message)
    _refuse_open_end(document, message)
    return trajectory, tuple(notes)


def decimal(text: str, where: str) -> float:
    """Parse the decimal number in ``text``.

    ``float`` accepts more than a planner writes: ``1_0.0``, ``infinity``, digits of other scripts.

    Raises:
        TrajectoryError: It is not a decimal number; the message begins with ``where``.
    """
    if _NUMBER.fullmatch(text) is None:
        raise TrajectoryError(
            f"{where}: {shown(text)} is not a number; write it like -0.25 or 1e-3"
        )
    return float(text)


def _refuse_open_end(document: Document, message: _Fields) -> None:
    for name in ("points", "joint_names"):
        if any(part is message[name] for part in document.unfinished):
            raise TrajectoryError(
                f"nothing follows the {name}, so the file may be truncated; if it is whole, end "
                f"it with a line '---' as ros2 topic echo does"
            )


def _joint_trajectory(document: Node) -> tuple[_Fields, list[str]]:
    """Return the joint trajectory in a message, and notes on omitted parts."""
    notes: list[str] = []
    message = _mapping(document, "the message")
    while True:
        notes += _left_out(message)
        if "joint_names" in message and "points" in message:
            return message, notes
        name = next((each for each in _WITHIN if each in message), None)
        if name is None:
            raise TrajectoryError(
                "holds no joint trajectory; it should be a JointTrajectory, a RobotTrajectory, a "
                "DisplayTrajectory, a goal of FollowJointTrajectory or ExecuteTrajectory, or a "
                "result of MoveGroup, or end in .csv"
            )
        inside = message[name]
        if isinstance(inside, list):
            if not inside:
                raise TrajectoryError(f"the message's {name} is empty: nothing was planned")
            if len(inside) > 1:
                notes.append(f"only the first of {len(inside)} trajectories in the message is used")
            inside, name = inside[0], f"{name}[0]"
        message = _mapping(inside, name)


def _left_out(message: _Fields) -> list[str]:
    """Return notes on the parts of a message that have no effect."""
    notes = []
    for name in _MULTI_DOF:
        if name in message and _mapping(message[name], name).get("points"):
            notes.append("the multi-dof part of the message is ignored: the arm has none")
    if any(message.get(name) for name in _TOLERANCES):
        notes.append("the tolerances of the goal are ignored: those of the arm apply")
    return notes


def _trajectory(message: _Fields) -> Trajectory:
    names = [_word(name, "joint_names") for name in _list(message["joint_names"], "joint_names")]
    points = [
        _mapping(item, f"point {index}")
        for index, item in enumerate(_list(message["points"], "points"))
    ]
    if not points:
        raise TrajectoryError("the trajectory has no points: nothing was planned")
    times: list[float] = []
    tables: dict[str, list[list[float]]] = {quantity: [] for quantity in _QUANTITIES}
    for index, point in enumerate(points):
        _refuse_unknown(point, _POINT, f"point {index}")
        times.append(_seconds(point, index))
        if any(_values(point, "effort", index, len(names))):
            raise TrajectoryError(
                f"point {index}: effort is given; the joints cannot control it, leave it out or 0"
            )
        for quantity, table in tables.items():
            values = _values(point, quantity, index, len(names))
            if bool(values) != bool(table) and index:
                without, having = (0, index) if values else (index, 0)
                raise TrajectoryError(
                    f"point {without}: no {quantity}, and point {having} has them; give them for "
                    f"all points or for none"
                )
            if values:
                table.append(values)
        if not tables["positions"]:
            raise TrajectoryError(f"point {index}: no positions")
    positions, velocities, accelerations = (table or None for table in tables.values())
    return Trajectory(names, times, positions or [], velocities, accelerations)


def _refuse_unknown(fields: _Fields, known: Sequence[str], where: str) -> None:
    for key in fields:
        if key not in known:
            hint = did_you_mean(key, known)
            raise TrajectoryError(
                f"{where}: unknown field {shown(key)}; it has {', '.join(known)}"
                f"{hint and f'; {hint}'}"
            )


def _values(point: _Fields, quantity: str, index: int, count: int) -> list[float]:
    if quantity not in point:
        return []
    where = f"point {index}: {quantity}"
    values = [decimal(_word(value, where), where) for value in _list(point[quantity], where)]
    if values and len(values) != count:
        raise TrajectoryError(
            f"point {index}: {len(values)} {quantity} for {count} joints; give one for each of "
            "joint_names, in their order"
        )
    return values


def _seconds(point: _Fields, index: int) -> float:
    where = f"point {index}: time_from_start"
    stamp = point.get("time_from_start")
    if isinstance(stamp, str) and _NUMBER.fullmatch(stamp):
        raise TrajectoryError(f"{where} is {stamp}; write it as {{sec: 2, nanosec: 500000000}}")
    stamp = _mapping(stamp, where)
    _refuse_unknown(stamp, _STAMP, where)
    if not stamp:
        raise TrajectoryError(f"{where} has no time; write it as {{sec: 2, nanosec: 500000000}}")
    seconds, nanoseconds = (decimal(_word(stamp.get(key, "0"), where), where) for key in _STAMP)
    return seconds + 1e-9 * nanoseconds


def _word(value: Node, where: str) -> str:
    if not isinstance(value, str):
        raise TrajectoryError(f"{where}: {shown(value)} is not one word; give a name or a number")
    if value == "...":
        raise TrajectoryError(f"{where}: '...' stands for what was left out; {FULL_LENGTH}")
    return value


def _mapping(value: Node, where: str) -> _Fields:
    if isinstance(value, dict):
        return value
    if value == "...":
        raise TrajectoryError(f"{where}: '...' stands for what was left out; {FULL_LENGTH}")
    raise TrajectoryError(f"{where} is not a set of fields; write 'field: value' lines below it")


def _list(value: Node, where: str) -> list[Node]:
    if not isinstance(value, list):
        raise TrajectoryError(f"{where} is not a list; write it as [a, b], or lines with a '-'")
    return value
