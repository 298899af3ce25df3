"""The messages of ROS 2 that hold a joint trajectory, as YAML.

moveit_msgs/DisplayTrajectory, moveit_msgs/RobotTrajectory and trajectory_msgs/JointTrajectory, in
the form of ``ros2 topic echo``: comment lines, documents ended by ``---``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bioscara.errors import TrajectoryError
from bioscara.planning.trajectory import Trajectory

POINTS_MAX = 100_000

_FIELDS = ("positions", "velocities", "accelerations")


def trajectory_of_yaml(text: str) -> tuple[Trajectory, tuple[str, ...]]:
    """Return the trajectory in the first message of ``text``, and notes.

    Raises:
        TrajectoryError: The text is no YAML, or no message with a joint trajectory.
    """
    document, notes = _first_document(text)
    message, more = _joint_trajectory(document)
    return _trajectory(message), (*notes, *more)


def _first_document(text: str) -> tuple[Any, list[str]]:
    # Slow to import, and needed for this kind of file only.
    from ruamel.yaml import YAML  # noqa: PLC0415
    from ruamel.yaml.error import YAMLError  # noqa: PLC0415
    from ruamel.yaml.tokens import AliasToken, DocumentStartToken, TagToken  # noqa: PLC0415

    yaml = YAML(typ="safe", pure=True)
    contents = documents = 0
    try:
        for token in yaml.scan(text):
            if isinstance(token, AliasToken | TagToken):
                raise TrajectoryError(
                    f"line {token.start_mark.line + 1}: aliases and tags have no place in a message"
                )
            documents += isinstance(token, DocumentStartToken)
            contents += 1
        first = next(iter(yaml.load_all(text)), None)
    except YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f"line {mark.line + 1}: " if mark is not None else ""
        problem = getattr(error, "problem", None) or str(error).splitlines()[0]
        raise TrajectoryError(f"{where}not readable as YAML: {problem}") from error
    except (ValueError, RecursionError) as error:
        raise TrajectoryError(f"not readable as YAML: {error}") from error
    if first is None:
        raise TrajectoryError("holds no message")
    rest = text.split("\n---", 1)
    more = len(rest) > 1 and any(
        line.strip() and not line.lstrip().startswith("#") and line.strip() != "---"
        for line in rest[1].splitlines()[1:]
    )
    return first, ["only the first of several messages is used"] if more else []


def _joint_trajectory(document: Any) -> tuple[Mapping[str, Any], list[str]]:
    notes: list[str] = []
    message = _mapping(document, "the message")
    if "trajectory" in message:
        parts = _sequence(message["trajectory"], "trajectory")
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


def _trajectory(message: Mapping[str, Any]) -> Trajectory:
    names = [str(name) for name in _sequence(message["joint_names"], "joint_names")]
    points = _sequence(message["points"], "points")
    if not points:
        raise TrajectoryError("the trajectory has no points: nothing was planned")
    if len(points) > POINTS_MAX:
        raise TrajectoryError(f"{len(points)} points; at most {POINTS_MAX} are read")
    times: list[float] = []
    tables: dict[str, list[list[float]]] = {field: [] for field in _FIELDS}
    given: set[str] = set()
    for index, item in enumerate(points):
        point = _mapping(item, f"point {index}")
        times.append(_seconds(point, index))
        if point.get("effort"):
            raise TrajectoryError(f"point {index}: effort is given; the joints cannot control it")
        here = set()
        for field in _FIELDS:
            values = _values(point, field, index, len(names))
            if values:
                here.add(field)
                tables[field].append(values)
        if "positions" not in here:
            raise TrajectoryError(f"point {index}: no positions")
        given = given & here if index else here
    full = [tables[field] if field in given else None for field in _FIELDS]
    if full[1] is None:
        full[2] = None
    return Trajectory(names, times, full[0] or [], full[1], full[2])


def _values(point: Mapping[str, Any], field: str, index: int, count: int) -> list[float]:
    values = _sequence(point.get(field) or [], f"point {index}: {field}")
    if values and len(values) != count:
        raise TrajectoryError(
            f"point {index}: {len(values)} {field} for {count} joints; truncated?"
        )
    return [_number(value, f"point {index}: {field}") for value in values]


def _seconds(point: Mapping[str, Any], index: int) -> float:
    stamp = _mapping(point.get("time_from_start"), f"point {index}: time_from_start")
    if "sec" not in stamp or "nanosec" not in stamp:
        raise TrajectoryError(
            f"point {index}: time_from_start needs sec and nanosec; is the file truncated?"
        )
    seconds = _number(stamp["sec"], f"point {index}: sec")
    return seconds + 1e-9 * _number(stamp["nanosec"], f"point {index}: nanosec")


def _number(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TrajectoryError(f"{what}: {value!r} is not a number")
    try:
        return float(value)
    except OverflowError:
        raise TrajectoryError(f"{what}: {value!r} is too large") from None


def _mapping(value: Any, what: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise TrajectoryError(f"{what} is not a set of fields; is the file truncated?")
    return value


def _sequence(value: Any, what: str) -> Sequence[Any]:
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise TrajectoryError(f"{what} is not a list; is the file truncated?")
    return value
