"""Activity, diagnostics, statistics and hardware status of the manager."""

from __future__ import annotations

import re
import sys
import threading
from collections.abc import Mapping

from control_msgs.msg import HardwareStatus
from controller_manager_msgs.msg import ControllerManagerActivity
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from pal_statistics_msgs.msg import Statistic, Statistics, StatisticsNames, StatisticsValues
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_system_default

from bioscara.api import messages as m
from bioscara.control.manager.diagnostics import default_thresholds
from bioscara.errors import BioscaraError
from bioscara.model.parameters import JOINTS
from bioscara.ros import messages
from bioscara.ros.bridge import Bridge
from bioscara.ros.controllers.loaded import LoadedControllers
from bioscara.ros.controllers.manager_services import described
from bioscara.ros.controllers.parameters import THRESHOLD
from bioscara.ros.hardware_status import ArmHealth, hardware_status

_LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
_PERIOD = 1.0
"""Time between two diagnostics [s]."""
_POSITIVE = FloatingPointRange(from_value=sys.float_info.min, to_value=sys.float_info.max)
_MANAGER = "Controller Manager Activity"
"""Name of the status of the manager itself."""
_OWN_PREFIX = "arm."
"""Begin of the names of the arm's own controllers."""


class Observation:
    """Publishes activity with each change, and the rest once a second."""

    def __init__(self, bridge: Bridge, loaded: LoadedControllers) -> None:
        self._bridge, self._loaded = bridge, loaded
        node = bridge.node
        self._activity = node.create_publisher(ControllerManagerActivity, "~/activity", _LATCHED)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        # In ros2_control each component has a node of its own, by its name.
        self._hardware = {
            component.name: node.create_publisher(
                HardwareStatus,
                f"{re.sub(r'[^A-Za-z0-9_]', '_', component.name)}/hardware_status",
                qos_profile_system_default,
            )
            for component in bridge.description.components
        }
        self._statistics = {
            topic: (
                node.create_publisher(Statistics, f"~/{topic}/full", 10),
                node.create_publisher(StatisticsNames, f"~/{topic}/names", _LATCHED),
                node.create_publisher(StatisticsValues, f"~/{topic}/values", 10),
            )
            for topic in ("introspection_data", "statistics")
        }
        self._paused_by: tuple[str, ...] = ()
        self._publishing = threading.Lock()
        self._states: tuple[dict[str, str], dict[str, str]] | None = None
        self._values: Mapping[str, m.ComponentValue] = {}
        # Names of the components in the description, by those of the owner.
        self._components: dict[str, str] = {}
        self._names: dict[str, tuple[str, ...]] = {}
        self._versions: dict[str, int] = {}
        self._declare_thresholds(round(1.0 / bridge.owner.robot.period))
        self._timer = node.create_timer(_PERIOD, self._tick, callback_group=bridge.parallel)

    def follow(self) -> None:
        """Publish the states of controllers and hardware, if they have changed.

        Raises:
            OwnerLostError: There is no owner.
        """
        # A list that was asked for before must not be published after a newer one.
        with self._publishing:
            self._publish_activity(self._loaded.follow())

    def lose(self) -> None:
        """Publish that there are no controllers and no hardware."""
        with self._publishing:
            self._publish_activity(m.ControllerList((), (), ()))

    def _publish_activity(self, listing: m.ControllerList) -> None:
        components = described(self._bridge, listing)
        states = (
            {each.name: each.state for each in listing.controllers},
            {name: value.state for name, value in components.items()},
        )
        self._values = components
        if components:
            self._components = {value.name: name for name, value in components.items()}
        if states != self._states:
            self._states = states
            self._activity.publish(messages.activity(self._now(), *states))

    def _now(self) -> float:
        return 1e-9 * float(self._bridge.node.get_clock().now().nanoseconds)

    def _tick(self) -> None:
        try:
            robot = self._bridge.owner.robot
            found = robot.controllers.introspection(self._thresholds())
            firmware = dict(zip(JOINTS, robot.firmware, strict=True))
            sources = frozenset({*self._components, *self._bridge.description.joints.values()})
            self._publish_hardware(ArmHealth(robot.faults, sources, firmware, found.values))
        except BioscaraError as error:
            self._publish_diagnostics((_status(_MANAGER, 2, str(error), {}),))
            return
        self._paused_by = robot.paused_by
        self._publish_diagnostics(tuple(map(self._status, found.diagnostics)))
        values = {
            self._described(name): value
            for name, value in found.values.items()
            if not name.startswith(_OWN_PREFIX)
        }
        times = {name: value for name, value in values.items() if not _is_interface(name)}
        self._publish_statistics("introspection_data", values)
        self._publish_statistics("statistics", times)

    def _publish_hardware(self, arm: ArmHealth) -> None:
        for component in self._bridge.description.components:
            if (value := self._values.get(component.name)) is not None:
                status = hardware_status(self._now(), component, value, arm)
                self._hardware[component.name].publish(status)

    def _status(self, value: m.DiagnosticValue) -> DiagnosticStatus:
        node = self._bridge.node.get_name()
        values = {
            name: text for name, text in value.values.items() if not name.startswith(_OWN_PREFIX)
        }
        values = {self._described(name): text for name, text in values.items()}
        level, message = value.level, self._described(value.message)
        if value.name == "Controllers Activity" and not self._loaded.names:
            level, message = max(level, 1), "no controllers are loaded"
        if value.name == _MANAGER and self._paused_by:
            paused = f"paused by {', '.join(self._paused_by)}"
            level, message = max(level, 1), f"{message}; {paused}" if level else paused
        if value.name == _MANAGER and (refusal := self._bridge.refusals.last):
            level, message = max(level, 1), f"{message}; {refusal}" if level else refusal
        return _status(f"{node}: {value.name}", level, message, values)

    def _publish_diagnostics(self, statuses: tuple[DiagnosticStatus, ...]) -> None:
        for status in statuses:
            if not status.name.startswith(self._bridge.node.get_name()):
                status.name = f"{self._bridge.node.get_name()}: {status.name}"
        self._diagnostics.publish(
            DiagnosticArray(header=messages.header(self._now()), status=list(statuses))
        )

    def _described(self, text: str) -> str:
        """Return the name of a value or a message with the names of the description."""
        kind, dot, rest = text.partition(".")
        if _is_interface(text):
            return kind + dot + self._bridge.description.described(rest)
        for own, name in self._components.items():
            text = re.sub(rf"\b{own}\b", name, text)
        return text

    def _declare_thresholds(self, rate: int) -> None:
        """Declare the thresholds, whose defaults depend on the rate of the owner."""
        node = self._bridge.node
        for name, value in default_thresholds(rate).items():
            unit = "Hz" if ".periodicity." in name else "us"
            if not node.has_parameter(THRESHOLD + name):
                descriptor = ParameterDescriptor(
                    description=f"Above this value [{unit}] the diagnostics say so",
                    floating_point_range=[_POSITIVE],
                )
                node.declare_parameter(THRESHOLD + name, value, descriptor)

    def _thresholds(self) -> dict[str, float]:
        found = self._bridge.node.get_parameters_by_prefix(THRESHOLD[:-1])
        known = default_thresholds(1)
        return {name: each.value for name, each in found.items() if name in known}

    def _publish_statistics(self, topic: str, values: dict[str, float]) -> None:
        full, names, numbers = self._statistics[topic]
        header = messages.header(self._now())
        keys = tuple(values)
        if keys != self._names.get(topic):
            self._names[topic] = keys
            self._versions[topic] = self._versions.get(topic, 0) + 1
            names.publish(
                StatisticsNames(
                    header=header, names=list(keys), names_version=self._versions[topic]
                )
            )
        full.publish(
            Statistics(
                header=header,
                statistics=[Statistic(name=name, value=value) for name, value in values.items()],
            )
        )
        numbers.publish(
            StatisticsValues(
                header=header, values=list(values.values()), names_version=self._versions[topic]
            )
        )


def _is_interface(name: str) -> bool:
    return name.startswith(("state_interface.", "command_interface."))


def _status(name: str, level: int, message: str, values: dict[str, str]) -> DiagnosticStatus:
    return DiagnosticStatus(
        name=name,
        level=bytes([level]),
        message=message,
        hardware_id="ros2_control",
        values=[KeyValue(key=key, value=value) for key, value in values.items()],
    )
