"""The controllers of the bringup, and what tests of the node do with them again and again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ros.rig import Ros
from served import HALF

BROADCASTER = "joint_state_broadcaster"
VELOCITY = "velocity_joint_trajectory_controller"
POSITION = "position_joint_trajectory_controller"
HOMING = "homing_controller"
GRIPPER = "gripper_controller"
JOINTS = ["j1", "j2", "j3", "j4"]
FOLLOW = "control_msgs/action/FollowJointTrajectory"
GRIP = "control_msgs/action/ParallelGripperCommand"
TRIGGER = "single_trigger_controller/SingleTriggerController"
NOTHING_TO_DO = (
    "After checking the controllers, no controllers need to be activated or deactivated."
)


def clear(ros: Ros) -> None:
    """Unload all controllers."""
    states = ros.states()
    active = [name for name, state in states.items() if state == "active"]
    if active:
        ros.switch((), active, strictness=1)
    for name in states:
        assert ros.manager("unload_controller", name=name)["ok"]


def energise(ros: Ros, *components: str) -> None:
    """Activate hardware."""
    for name in components or ("bioscara_arm",):
        answer = ros.hardware(name, "active")
        assert answer["ok"], answer


def point(*positions: float, at: float, **fields: Any) -> dict[str, Any]:
    """Return a point of a trajectory at a time [s]."""
    second = int(at)
    time = {"sec": second, "nanosec": round((at - second) * 1e9)}
    return {"positions": list(positions), "time_from_start": time, **fields}


def goal(*points: dict[str, Any], joints: Sequence[str] = JOINTS, **fields: Any) -> dict[str, Any]:
    """Return a goal of the trajectory action."""
    return {"trajectory": {"joint_names": list(joints), "points": list(points)}, **fields}


def near(distance: float, *, at: float) -> dict[str, Any]:
    """Return a point at which the first joint is off its place of rest by a distance [rad]."""
    return point(HALF[0] + distance, *HALF[1:], at=at)


def follow(ros: Ros, controller: str, sent: dict[str, Any]) -> int | None:
    """Send a goal; return its number, or none if it was rejected."""
    name = f"{ros.namespace}/{controller}/follow_joint_trajectory"
    number: int | None = ros.do("goal", type=FOLLOW, name=name, goal=sent)
    return number


def ended(ros: Ros, number: int | None, timeout: float = 60.0) -> dict[str, Any]:
    """Return how a goal ended."""
    assert number is not None, "the goal was rejected"
    result: dict[str, Any] = ros.do("result", number=number, timeout=timeout)
    return result


def go_home(ros: Ros, controller: str = VELOCITY) -> None:
    """Move the arm to where tests expect it, by an active trajectory controller."""
    assert ended(ros, follow(ros, controller, goal(near(0.0, at=1.5))))["status"] == 4
