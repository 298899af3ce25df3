"""The common parts of the node."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.parameter import Parameter
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

from bioscara.errors import BioscaraError
from bioscara.ros.arm.description import RobotDescription
from bioscara.ros.arm_time import ArmTime
from bioscara.ros.controllers.goals import GoalEnds
from bioscara.ros.owner import OwnerConnection
from bioscara.ros.refusals import Refusals

SERVICES = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)
"""Quality of service of the manager's services: no call is dropped while another one runs."""


@dataclass
class Bridge:
    """The common parts of the node.

    Attributes:
        node: The node ``controller_manager``.
        executor: Runs the callbacks of all nodes.
        description: The robot description.
        owner: The connection to the owner of the arm.
        time: Converts times.
        sections: Parameters in the arguments of the process, by the full name of their node.
        goals: Goals of controllers.
        refusals: The last refusal.
        serial: Callbacks that change controllers: one runs at a time.
        parallel: Callbacks that run in parallel to all others.
    """

    node: Any
    executor: Any
    description: RobotDescription
    owner: OwnerConnection
    time: ArmTime
    sections: Mapping[str, frozenset[str]]
    goals: GoalEnds = field(default_factory=GoalEnds)
    refusals: Refusals = field(default_factory=Refusals)
    serial: Any = field(default_factory=MutuallyExclusiveCallbackGroup)
    parallel: Any = field(default_factory=ReentrantCallbackGroup)

    def parameter(self, name: str) -> Any:
        """Return a parameter of the manager; None if it is not given."""
        return self.node.get_parameter_or(name, Parameter(name)).value

    def attempt(self, what: str, call: Callable[[], str | None]) -> tuple[bool, str]:
        """Carry out a client's request; a refusal is in the log and the diagnostics.

        Args:
            what: The request, for the log.
            call: Does it, and returns the message for the client.

        Returns:
            Whether it was done, and the message: why not, otherwise.
        """
        try:
            answer = call() or ""
        except BioscaraError as error:
            self.refuse(f"{what}: {error}")
            return False, str(error)
        except Exception as error:  # noqa: BLE001  a client without an answer would not stop waiting
            self.node.get_logger().fatal(f"{what}, a defect: {error!r}")
            return False, f"the node has a defect: {error!r}"
        self.refusals.clear()
        return True, answer

    def refuse(self, text: str) -> None:
        """Report a refusal with its reason where a person sees it: in log and diagnostics."""
        self.node.get_logger().error(text)
        self.refusals.add(text)
