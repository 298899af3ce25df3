"""Reading of ROS 2 messages with a joint trajectory, as YAML.

moveit_msgs/DisplayTrajectory, moveit_msgs/RobotTrajectory and trajectory_msgs/JointTrajectory, in
the format of ``ros2 topic echo``: comment lines, messages terminated by ``---``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TypeAlias

from bioscara.arguments import shown
from bioscara.errors import TrajectoryError
from bioscara.planning.files.ros_message_parser import FULL_LENGTH, Document, Node, first_document
from bioscara.planning.trajectory.trajectory import Trajectory
from bioscara.spelling import did_you_mean

_Fields: TypeAlias = dict[str, Node]

_QUANTITIES = ("positions", "velocities", "accelerations")
_POINT = (*_QUANTITIES, "effort", "time_from_start")
_STAMP = ("sec", "nanosec")
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")


def trajectory_of_yaml(text: str) -> tuple[Trajectory, tuple[str, ...]]:
    """Return the trajectory in the first message of ``text``, and notes.

    Raises:
        TrajectoryError: The text is not a message with a joint trajectory, or may be truncated.
    """
    document = first_document(text)
    if document.value is None:
        raise TrajectoryError("holds no message")
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
    notes: list[str] = []
    message = _mapping(document, "the message")
    if "trajectory" in message:
        parts = _list(message["trajectory"], "trajectory")
        if not parts:
            raise TrajectoryError("the message's trajectory is empty: nothing was planned")
        if len(parts) > 1:
            notes.append(f"only the first of {len(parts)} trajectories in the message is used")
        message = _mapping(parts[0], "trajectory[0]")
    if "multi_dof_joint_trajectory" in message:
        other = _mapping(message["multi_dof_joint_trajectory"], "multi_dof_joint_trajectory")
        if other.get("points"):
            notes.append("the multi-dof part of the message is ignored: the arm has none")
    if "joint_trajectory" in message:
        message = _mapping(message["joint_trajectory"], "joint_trajectory")
    if "joint_names" not in message or "points" not in message:
        raise TrajectoryError(
            "holds no joint trajectory; it should be a moveit_msgs/DisplayTrajectory, "
            "moveit_msgs/RobotTrajectory or trajectory_msgs/JointTrajectory, or end in .csv"
        )
    return message, notes


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
        if point.get("effort"):
            raise TrajectoryError(f"point {index}: effort is given; the joints cannot control it")
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
            f"point {index}: {len(values)} {quantity} for {count} joints; is the file truncated?"
        )
    return values


def _seconds(point: _Fields, index: int) -> float:
    where = f"point {index}: time_from_start"
    stamp = _mapping(point.get("time_from_start"), where)
    _refuse_unknown(stamp, _STAMP, where)
    if len(stamp) != len(_STAMP):
        raise TrajectoryError(f"{where} needs sec and nanosec; is the file truncated?")
    seconds, nanoseconds = (decimal(_word(stamp[key], where), where) for key in _STAMP)
    return seconds + 1e-9 * nanoseconds


def _word(value: Node, where: str) -> str:
    if not isinstance(value, str):
        raise TrajectoryError(f"{where}: {shown(value)} is not one word; is the file truncated?")
    if value == "...":
        raise TrajectoryError(f"{where}: '...' stands for what was left out; {FULL_LENGTH}")
    return value


def _mapping(value: Node, where: str) -> _Fields:
    if isinstance(value, dict):
        return value
    if value == "...":
        raise TrajectoryError(f"{where}: '...' stands for what was left out; {FULL_LENGTH}")
    raise TrajectoryError(f"{where} is not a set of fields; is the file truncated?")


def _list(value: Node, where: str) -> list[Node]:
    if not isinstance(value, list):
        raise TrajectoryError(f"{where} is not a list; is the file truncated?")
    return value
