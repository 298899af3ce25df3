"""Activity, diagnostics and statistics of the manager."""

from __future__ import annotations

from controller_manager_msgs.msg import ControllerManagerActivity
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from pal_statistics_msgs.msg import Statistic, Statistics, StatisticsNames, StatisticsValues
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from bioscara.api import messages as m
from bioscara.errors import BioscaraError
from bioscara.ros import messages
from bioscara.ros.bridge import Bridge
from bioscara.ros.controllers.loaded import LoadedControllers
from bioscara.ros.controllers.manager_services import described

_LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
_PERIOD = 1.0
"""Time between two diagnostics [s]."""
_OWN_PREFIX = "arm."
"""Begin of the names of the arm's own controllers."""


class Observation:
    """Publishes activity with each change, and the rest once a second.

    Args:
        bridge: The common parts of the node.
        loaded: The controllers.
    """

    def __init__(self, bridge: Bridge, loaded: LoadedControllers) -> None:
        self._bridge, self._loaded = bridge, loaded
        node = bridge.node
        self._activity = node.create_publisher(ControllerManagerActivity, "~/activity", _LATCHED)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._statistics = {
            topic: (
                node.create_publisher(Statistics, f"~/{topic}/full", 10),
                node.create_publisher(StatisticsNames, f"~/{topic}/names", _LATCHED),
                node.create_publisher(StatisticsValues, f"~/{topic}/values", 10),
            )
            for topic in ("introspection_data", "statistics")
        }
        self._names: dict[str, tuple[str, ...]] = {}
        self._versions: dict[str, int] = {}
        self._timer = node.create_timer(_PERIOD, self._tick, callback_group=bridge.parallel)

    def publish_activity(self, listing: m.ControllerList) -> None:
        """Publish the states of the controllers and of the hardware in a list."""
        controllers = {each.name: each.state for each in listing.controllers}
        components = {name: value.state for name, value in described(self._bridge, listing).items()}
        self._activity.publish(messages.activity(self._now(), controllers, components))

    def _now(self) -> float:
        return 1e-9 * float(self._bridge.node.get_clock().now().nanoseconds)

    def _tick(self) -> None:
        try:
            found = self._bridge.owner.robot.controllers.introspection()
        except BioscaraError as error:
            self._publish_diagnostics((_without_owner(str(error)),))
            return
        self._publish_diagnostics(tuple(map(self._status, found.diagnostics)))
        values = {
            self._described(name): value
            for name, value in found.values.items()
            if not name.startswith(_OWN_PREFIX)
        }
        times = {name: value for name, value in values.items() if not _is_interface(name)}
        self._publish_statistics("introspection_data", values)
        self._publish_statistics("statistics", times)

    def _status(self, value: m.DiagnosticValue) -> DiagnosticStatus:
        node = self._bridge.node.get_name()
        values = {
            name: text for name, text in value.values.items() if not name.startswith(_OWN_PREFIX)
        }
        level, message = value.level, value.message
        if value.name == "Controllers Activity" and not self._loaded.names:
            level, message = max(level, 1), "no controllers are loaded"
        return _status(f"{node}: {value.name}", level, message, values)

    def _publish_diagnostics(self, statuses: tuple[DiagnosticStatus, ...]) -> None:
        for status in statuses:
            if not status.name.startswith(self._bridge.node.get_name()):
                status.name = f"{self._bridge.node.get_name()}: {status.name}"
        self._diagnostics.publish(
            DiagnosticArray(header=messages.header(self._now()), status=list(statuses))
        )

    def _described(self, name: str) -> str:
        """Return the name of a value, with the joint as the description names it."""
        kind, dot, rest = name.partition(".")
        if _is_interface(name):
            return kind + dot + self._bridge.description.described(rest)
        return name

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


def _without_owner(reason: str) -> DiagnosticStatus:
    return _status("Controller Manager Activity", 2, reason, {})
