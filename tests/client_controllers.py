"""Controllers that a client loads into a served arm, and the ends of their goals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from bioscara import Robot
from bioscara.api import messages as m
from bioscara.control.controllers.joint_trajectory import Goal, JointTrajectory, Point
from bioscara.remote import RemoteRobot
from bioscara.server.serve import Served
from bioscara.sim import SimulatedArm
from served import NAME, arm_served, eventually

JOINTS = ("j1", "j2", "j3", "j4")
JTC = "joint_trajectory_controller/JointTrajectoryController"
FORWARD = "forward_command_controller/ForwardCommandController"
HOMING = "single_trigger_controller/SingleTriggerController"
GRIPPER = "parallel_gripper_action_controller/GripperActionController"
BROADCASTER = "joint_state_broadcaster/JointStateBroadcaster"
POSITION_JTC = "position_joint_trajectory_controller"
VELOCITY_JTC = "velocity_joint_trajectory_controller"
FILE = Path(__file__).parents[1] / "ros/bioscara_arm_bringup/config/bioscara_arm_controllers.yaml"
STEP = (0.3, 0.02, 0.2, 0.2)
"""A displacement that is clear from where the served arm stands [rad, m, rad, rad]."""


def parameter_file() -> dict[str, dict[str, Any]]:
    """Return type and parameters of each controller in the file of the existing arms."""
    sections = yaml.safe_load(FILE.read_text())
    types = sections.pop("controller_manager")["ros__parameters"]
    return {
        name: {"kind": types[name]["type"], "parameters": section["ros__parameters"]}
        for name, section in sections.items()
    }


class Site:
    """A served arm, a client of it, and the samples that the client gets.

    Attributes:
        served: The served arm.
        robot: The client.
        samples: The samples that it received.
    """

    def __init__(self, served: Served, robot: RemoteRobot) -> None:
        self.served, self.robot = served, robot
        self.samples: list[m.ControllersSample] = []
        robot.controllers.subscribe(self.samples.append)

    @property
    def plant(self) -> SimulatedArm:
        """The simulated arm, which has the true positions of its joints."""
        return self.served.robot.bus.arm  # type: ignore[attr-defined]

    @property
    def positions(self) -> tuple[float, ...]:
        """Where the joints are."""
        return tuple(self.plant.position(name) for name in JOINTS)

    @property
    def speed(self) -> float:
        """Highest speed of a joint, as a share of its limit."""
        joints = self.served.robot.parameters.joints
        return max(abs(self.plant.velocity(each.name)) / each.max_velocity for each in joints)

    @property
    def newest(self) -> m.ControllersSample:
        """The newest sample."""
        eventually(lambda: self.samples, what="a sample")
        return self.samples[-1]

    def load(self, name: str, kind: str, parameters: dict[str, Any] | None = None) -> None:
        """Load and configure a controller."""
        self.robot.controllers.load(name, kind, parameters)
        self.robot.controllers.configure(name)

    def activated(self, name: str) -> None:
        """Load a controller of the file, and activate it."""
        self.load(name, **parameter_file()[name])
        self.robot.controllers.switch([name])

    def follow(
        self, name: str, step: Sequence[float] = STEP, *, time: float = 3.0, **fields: Any
    ) -> int:
        """Send a goal by a displacement from where the arm stands; return its number."""
        goal = Goal(self.trajectory(step, time=time), **fields)
        return self.robot.controllers.follow(name, goal)

    def trajectory(self, step: Sequence[float] = STEP, *, time: float = 3.0) -> JointTrajectory:
        """Return a trajectory by a displacement from where the arm stands."""
        positions = [a + b for a, b in zip(self.robot.state.positions, step, strict=True)]
        return JointTrajectory(JOINTS, (Point(time, tuple(positions)),))

    def ended(self, goal: int) -> m.EndedGoal:
        """Return how a goal ended, once it has."""
        found: list[m.EndedGoal] = []

        def seen() -> bool:
            found[:] = [each for each in self.newest.ended if each.goal == goal]
            return bool(found)

        eventually(seen, what=f"the end of goal {goal}")
        return found[0]

    def moving(self) -> None:
        """Wait until the arm moves."""
        eventually(lambda: self.speed > 0.05, what="motion")

    def at_rest(self) -> None:
        """Wait until no operation runs, and require that the joints stand then."""
        eventually(lambda: not self.robot.is_moving, what="the end of the operation")
        before = self.positions
        self.passed(0.5)
        # The belts may still swing at first.
        assert self.speed < 0.01
        assert all(abs(a - b) < 2e-3 for a, b in zip(self.positions, before, strict=True))

    def passed(self, duration: float) -> None:
        """Wait for simulated time [s]."""
        end = self.newest.time + duration
        eventually(lambda: self.newest.time >= end, what=f"{duration:g} s of the arm")

    def states(self) -> dict[str, str]:
        """Return the state of each controller."""
        return {each.name: each.state for each in self.robot.controllers.list().controllers}


@contextmanager
def site(speed: float = 20.0, **settings: Any) -> Iterator[Site]:
    """Serve an arm and connect a client; arguments as of :func:`served.arm_served`."""
    with arm_served(speed=speed, **settings) as served, Robot.connect(f"arm:{NAME}") as robot:
        assert isinstance(robot, RemoteRobot)
        yield Site(served, robot)


def values_of(sample: m.ControllersSample) -> dict[str, float]:
    """Return the values of the state interfaces of a sample by name."""
    return dict(zip(sample.state_names, sample.states, strict=True))
