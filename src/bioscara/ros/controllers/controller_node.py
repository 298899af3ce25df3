"""A loaded controller as ROS sees it: a node of its name, with its parameters."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node

from bioscara.api import messages as m
from bioscara.errors import BioscaraError, ConfigurationError
from bioscara.ros.bridge import Bridge
from bioscara.ros.controllers.inbox import PATIENCE, Inbox
from bioscara.ros.controllers.parameter_names import DescribedParameter, known
from bioscara.ros.controllers.parameter_sections import sections


class ControllerNode:
    """The node of a controller; a subclass adds the interfaces of its type while it is configured.

    Args:
        bridge: The common parts of the node.
        name: Name of the controller.
        kind: Its type.
        arguments: Further arguments of the node, as ``--params-file FILE``. A parameter that its
            type does not have is left out, unless it is in the section of this node.

    Attributes:
        node: The node.
        name: As given.
        kind: As given.
        sent: Parameters that the owner has, as it got them; None if it refuses them so far.
        configured: Whether the controller is configured.

    Raises:
        ConfigurationError: ROS refuses the name or the arguments.
    """

    def __init__(self, bridge: Bridge, name: str, kind: str, arguments: list[str]) -> None:
        self.bridge, self.name, self.kind = bridge, name, kind
        self.sent: dict[str, Any] | None = None
        self.configured = False
        self._entities: list[tuple[Any, Any]] = []
        # Held while the entities are used by the thread that publishes, or made or destroyed.
        self._publishing = threading.Lock()
        try:
            self.node = Node(
                name,
                context=bridge.node.context,
                cli_args=["--ros-args", *arguments, "--"] if arguments else None,
                allow_undeclared_parameters=True,
                automatically_declare_parameters_from_overrides=True,
            )
        except Exception as error:
            # Of rclpy, for a file that is missing or wrong, arguments, and names.
            raise ConfigurationError(f"the node {name} cannot be made: {error}") from error
        self._ignored = self._not_its_own(sections(arguments))
        # Parameters that no file sets: they were declared with their default values.
        self._defaults: dict[str, Any] = {}
        self.node.add_on_set_parameters_callback(self._check_parameters)
        bridge.executor.add_node(self.node)

    def parameters(self) -> dict[str, Any]:
        """Return the node's parameters that were given, by their names with dots."""
        found = self.node.get_parameters_by_prefix("")
        values = {name: parameter.value for name, parameter in found.items()}
        return {
            name: value
            for name, value in values.items()
            if name not in self._ignored and self._defaults.get(name) != value
        }

    def declare(self, parameters: Iterable[DescribedParameter]) -> None:
        """Declare parameters with their descriptions; those without a value have the default."""
        for each in parameters:
            if self.node.has_parameter(each.name):
                # As a file has it, whole numbers are integers, and could not change to others.
                value = type(each.default)(self.node.get_parameter(each.name).value)
                self.node.undeclare_parameter(each.name)
            else:
                value = self._defaults[each.name] = each.default
            self.node.declare_parameter(each.name, value, each.descriptor, ignore_override=True)

    def configure(self) -> None:
        """Offer the controller's interfaces from now on."""
        with self._publishing:
            if not self.configured:
                self.create()
                self.configured = True

    def cleanup(self) -> None:
        """Stop offering it."""
        with self._publishing:
            self.configured = False
            while self._entities:
                destroy, entity = self._entities.pop()
                destroy(entity)

    def take(self, sample: m.ControllersSample) -> None:
        """Publish what a sample has of this controller, which is active, while it is configured."""
        with self._publishing:
            if self.configured:
                self.publish(sample)

    def close(self) -> None:
        """End the node."""
        self.cleanup()
        self.bridge.executor.remove_node(self.node)
        self.node.destroy_node()

    def create(self) -> None:
        """Create topics, services and actions; here none."""

    def publish(self, sample: m.ControllersSample) -> None:
        """Publish what a sample has of this controller; here nothing."""

    def report(self, ended: m.EndedGoal) -> None:
        """Report the end of a goal where no action does; here not."""

    def changed(self, parameters: Mapping[str, Any]) -> str:
        """Apply parameters that were set while it is configured; return why not, or nothing."""
        names = sorted(set(parameters) - {"use_sim_time"})
        if not names:
            return ""
        return (
            f"{', '.join(names)} cannot be changed while {self.name} is configured; clean it up "
            "first"
        )

    def publisher(self, kind: Any, topic: str, qos: Any) -> Any:
        """Create a publisher."""
        entity = self.node.create_publisher(kind, topic, qos)
        self._entities.append((self.node.destroy_publisher, entity))
        return entity

    def subscription(
        self,
        kind: Any,
        topic: str,
        callback: Any,
        qos: Any,
        *,
        waiting: int = 1,
        patience: float = PATIENCE,
    ) -> None:
        """Create a subscription; errors of the callback, which may wait, are logged.

        Args:
            kind: Type of the messages.
            topic: Topic.
            callback: Called with each message, in a thread of the subscription.
            qos: Quality of service.
            waiting: Number of messages that wait for the callback; the newest ones are kept.
            patience: Time after which a message that has waited is dropped [s].
        """

        def warn(text: str) -> None:
            self.node.get_logger().warning(
                f"{topic}: {text}", throttle_duration_sec=1.0, skip_first=False
            )

        def receive(message: Any) -> None:
            try:
                callback(message)
            except BioscaraError as error:
                warn(str(error))
            except Exception as error:  # noqa: BLE001  the next message may be better
                warn(f"a defect: {error!r}")

        inbox = Inbox(receive, waiting, patience, warn, f"{self.name}-{topic}")
        # A group of its own: messages must not overtake one another.
        entity = self.node.create_subscription(
            kind, topic, inbox.put, qos, callback_group=MutuallyExclusiveCallbackGroup()
        )

        def destroy(subscription: Any) -> None:
            self.node.destroy_subscription(subscription)
            inbox.close()

        self._entities.append((destroy, entity))

    def service(self, kind: Any, name: str, callback: Any) -> None:
        """Create a service."""
        entity = self.node.create_service(kind, name, callback, callback_group=self.bridge.parallel)
        self._entities.append((self.node.destroy_service, entity))

    def own(self, action: Any, finish: Callable[[], object]) -> None:
        """Destroy an action server with the other entities, after ``finish``."""

        def destroy(server: Any) -> None:
            finish()
            server.destroy()

        self._entities.append((destroy, action))

    def _not_its_own(self, given: Mapping[str, frozenset[str]]) -> frozenset[str]:
        """Return the unknown parameters that are not in its own section, and report them."""
        node = self.node.get_fully_qualified_name()
        own = frozenset().union(*(each.get(node, ()) for each in (self.bridge.sections, given)))
        names = self.node.get_parameters_by_prefix("").keys() - own
        found = frozenset(name for name in names if not known(self.kind, name))
        if found:
            self.node.get_logger().warning(
                f"{', '.join(sorted(found))}: ignored; a {self.kind} has no such parameter, and "
                f"the section of {node} does not give it"
            )
        return found

    def _check_parameters(self, parameters: list[Any]) -> SetParametersResult:
        unknown = [each.name for each in parameters if not known(self.kind, each.name)]
        reason = ""
        if unknown:
            reason = f"{', '.join(unknown)}: a {self.kind} has no such parameter"
        elif self.configured:
            try:
                reason = self.changed({each.name: each.value for each in parameters})
            except BioscaraError as error:
                reason = str(error)
        return SetParametersResult(successful=not reason, reason=reason)
