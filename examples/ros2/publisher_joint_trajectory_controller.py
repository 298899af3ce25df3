#!/usr/bin/env python3
"""Publish goals of a trajectory controller in turn, one every few seconds.

Parameters, as those of the test publisher of ros2_controllers: ``controller_name``, ``joints``,
``goal_names``; for each goal ``<goal>.positions``, ``.velocities``, ``.accelerations``,
``.effort``, or its positions as a list ``<goal>``; ``wait_sec_between_publish`` [s];
``check_starting_point``, and ``starting_point_limits.<joint>``, the range [rad or m] of each
joint at the start.
The arm must be homed and the controller active. Run it with a parameter file:

    python publisher_joint_trajectory_controller.py --ros-args --params-file FILE
"""

from __future__ import annotations

import math
import signal
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import cycle
from typing import Any

NODE = "publisher_joint_trajectory_controller"
FIELDS = ("positions", "velocities", "accelerations", "effort")
TRAVEL_TIME = 4
"""Time from the start of a trajectory to its only point [s]."""
ANYWHERE = (-2.0 * math.pi, 2.0 * math.pi)
"""Range of the start of a joint that has no limits."""


@dataclass(frozen=True)
class Goal:
    """A goal of the controller.

    Attributes:
        name: Its name in the parameters.
        values: Its fields with one value for each joint [rad and m; per s; per s^2].
    """

    name: str
    values: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class Task:
    """Everything that the parameters say.

    Attributes:
        controller: Name of the controller.
        joints: Names of its joints, in the order of the values.
        wait: Time between two messages [s].
        goals: Goals in their order.
        start: Range in which each joint must be at the start [rad or m]; empty for no check.
    """

    controller: str
    joints: tuple[str, ...]
    wait: float
    goals: tuple[Goal, ...]
    start: Mapping[str, tuple[float, float]]

    @property
    def topic(self) -> str:
        """Topic of the controller's trajectories."""
        return f"{self.controller}/joint_trajectory"


def read_task(parameters: Mapping[str, Any]) -> Task:
    """Return the task that parameters describe.

    Args:
        parameters: Values by their full names, such as ``pos1.positions``.

    Raises:
        ValueError: A parameter is missing, or has the wrong number of values.
    """
    joints = tuple(name for name in parameters.get("joints", ()) if name)
    names = tuple(parameters.get("goal_names", ("pos1", "pos2")))
    wait = float(parameters.get("wait_sec_between_publish", 6))
    if not joints:
        raise ValueError("joints is empty: list the joints of the controller")
    if not names:
        raise ValueError("goal_names is empty: name at least one goal")
    if not (math.isfinite(wait) and wait > 0.0):
        raise ValueError(f"wait_sec_between_publish is {wait:g} s but must be above 0 s")
    start = {}
    if parameters.get("check_starting_point", False):
        start = {name: _range(parameters, name) for name in joints}
    return Task(
        controller=str(parameters.get("controller_name", "position_trajectory_controller")),
        joints=joints,
        wait=wait,
        goals=tuple(_goal(parameters, name, len(joints)) for name in names),
        start=start,
    )


def _goal(parameters: Mapping[str, Any], name: str, count: int) -> Goal:
    given = {"positions": parameters.get(name)}
    for field in FIELDS:
        given[field] = parameters.get(f"{name}.{field}", given.get(field))
    values = {field: tuple(map(float, each)) for field, each in given.items() if each}
    if not values:
        raise ValueError(f"goal {name} has no values: give {name}.positions")
    for field, each in values.items():
        if len(each) != count:
            raise ValueError(f"{name}.{field} has {len(each)} values; there are {count} joints")
        if not all(map(math.isfinite, each)):
            raise ValueError(f"{name}.{field} is {list(each)}; each value must be finite")
    return Goal(name, values)


def _range(parameters: Mapping[str, Any], joint: str) -> tuple[float, float]:
    name = f"starting_point_limits.{joint}"
    limits = tuple(map(float, parameters.get(name, ANYWHERE)))
    if len(limits) != 2 or not limits[0] <= limits[1]:
        raise ValueError(f"{name} is {list(limits)}; it must be a lower and an upper limit")
    return limits[0], limits[1]


def outside(task: Task, names: Iterable[str], positions: Sequence[float]) -> list[str] | None:
    """Return a sentence for each joint that is not where the arm has to start.

    Joints that are not the controller's are ignored, such as the gripper's.

    Args:
        task: The task.
        names: Names of the joints of a joint state.
        positions: Their positions [rad or m].

    Returns:
        None while joints of the controller are missing in the state or have no position yet.
    """
    at = dict(zip(names, positions, strict=True))
    if any(math.isnan(at.get(joint, math.nan)) for joint in task.start):
        return None
    return [
        f"{joint} is at {at[joint]:g}, outside {lower:g} .. {upper:g}"
        for joint, (lower, upper) in task.start.items()
        if not lower <= at[joint] <= upper
    ]


def main() -> int:
    """Publish until Ctrl-C; return the exit status."""
    # Imported here: the rest is used and tested without ROS.
    import rclpy  # noqa: PLC0415
    from builtin_interfaces.msg import Duration  # noqa: PLC0415
    from rclpy.executors import ExternalShutdownException  # noqa: PLC0415
    from sensor_msgs.msg import JointState  # noqa: PLC0415
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint  # noqa: PLC0415

    # launch repeats Ctrl-C, on which the handler of rclpy ends the node; Python's would interrupt
    # the end itself.
    signal.signal(signal.SIGINT, lambda *_: None)
    rclpy.init()
    node = rclpy.create_node(NODE, automatically_declare_parameters_from_overrides=True)
    log = node.get_logger()
    try:
        given = node.get_parameters_by_prefix("")
        task = read_task({name: value.value for name, value in given.items()})
    except ValueError as error:
        log.fatal(str(error))
        return 2
    publisher = node.create_publisher(JointTrajectory, task.topic, 1)
    goals = cycle(task.goals)
    started = not task.start

    def check(state: Any) -> None:
        nonlocal started
        found = outside(task, state.name, state.position)
        if found is None or started:
            return
        if found:
            text = f"not started: {'; '.join(found)}"
            log.warning(text, throttle_duration_sec=task.wait)
        started = not found

    def publish() -> None:
        if not started:
            return
        goal = next(goals)
        point = JointTrajectoryPoint(
            **{field: list(values) for field, values in goal.values.items()},
            time_from_start=Duration(sec=TRAVEL_TIME),
        )
        # A stamp of 0 starts the trajectory as soon as it arrives.
        publisher.publish(JointTrajectory(joint_names=list(task.joints), points=[point]))
        text = f"{goal.name}: {list(goal.values.get('positions', ()))}"
        log.info(text)

    if task.start:
        node.create_subscription(JointState, "joint_states", check, 10)
    node.create_timer(task.wait, publish)
    with suppress(ExternalShutdownException):
        rclpy.spin(node)
    return 0


if __name__ == "__main__":
    sys.exit(main())
