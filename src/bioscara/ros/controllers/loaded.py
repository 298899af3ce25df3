"""The controllers that clients of ROS have loaded."""

from __future__ import annotations

import threading
from typing import Any

import msgspec

from bioscara.api import messages as m
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.controllers.gripper_action_controller import GripperActionController
from bioscara.control.controllers.homing_controller import HomingController
from bioscara.control.controllers.joint_state_broadcaster import JointStateBroadcaster
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController
from bioscara.errors import BioscaraError, ConfigurationError, SwitchError
from bioscara.remote.remote_robot import RemoteRobot
from bioscara.ros.bridge import Bridge
from bioscara.ros.controllers import parameters
from bioscara.ros.controllers.broadcaster import BroadcasterNode
from bioscara.ros.controllers.controller_node import ControllerNode
from bioscara.ros.controllers.forward import ForwardNode
from bioscara.ros.controllers.gripper import GripperNode
from bioscara.ros.controllers.homing import HomingNode
from bioscara.ros.controllers.trajectory import TrajectoryNode

_NODES: dict[str, type[ControllerNode]] = {
    ForwardCommandController.TYPE: ForwardNode,
    GripperActionController.TYPE: GripperNode,
    HomingController.TYPE: HomingNode,
    JointStateBroadcaster.TYPE: BroadcasterNode,
    JointTrajectoryController.TYPE: TrajectoryNode,
}
"""Node of each type; controllers of other types have parameters only."""


class LoadedControllers:
    """Loads controllers into the owner, each with a node of its name."""

    def __init__(self, bridge: Bridge) -> None:
        self._bridge = bridge
        self._nodes: dict[str, ControllerNode] = {}
        self._ended: frozenset[int] = frozenset()
        # Held while nodes are added or removed, which services and the loss of the owner do.
        self._lock = threading.RLock()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the controllers, in the order in which they were loaded."""
        return tuple(self._nodes)

    def waits(self, name: str) -> bool:
        """Return whether a loaded controller waits for parameters that the owner takes."""
        node = self._nodes.get(name)
        return node is not None and node.sent is None

    def load(self, name: str) -> None:
        """Load a controller, whose type and files are parameters of the manager.

        Raises:
            SwitchError: It is loaded already, or has no type.
            BioscaraError: The owner refuses it.
        """
        if name in self._nodes:
            raise SwitchError(f"a controller named {name} is loaded already")
        kind = self._bridge.parameter(f"{name}.type")
        if not kind:
            raise SwitchError(
                f"the type of {name} is unknown: it has to be the parameter {name}.type of "
                f"{self._bridge.node.get_name()}"
            )
        if not isinstance(kind, str):
            raise SwitchError(f"parameter {name}.type is {kind!r}; give the name of a type")
        arguments = self._arguments(name)
        with self._lock:
            node = _NODES.get(kind, ControllerNode)(self._bridge, name, kind, arguments)
            try:
                self._bridge.owner.command(lambda robot: self._load(robot, node))
            except ConfigurationError as error:
                # As there: parameters are checked when it is configured.
                node.node.get_logger().warning(f"cannot be configured so far: {error}")
            except BaseException:
                node.close()
                raise
            self._nodes[name] = node

    def configure(self, name: str) -> None:
        """Configure a controller, with its parameters as they are now.

        Raises:
            SwitchError: It is not loaded, or is active.
            BioscaraError: The owner refuses it.
        """
        node, was = self._get(name), self._get(name).configured

        def configure(robot: RemoteRobot) -> None:
            self._update(robot, node)
            robot.controllers.configure(name)

        with self._lock:
            self._bridge.owner.command(configure)
            if was:
                # The topics follow parameters, which may have changed.
                node.cleanup()
            node.configure()

    def cleanup(self, name: str) -> None:
        """Clean a controller up; errors as :meth:`configure`."""
        node = self._get(name)
        if node.sent is None:
            return
        with self._lock:
            self._bridge.owner.command(lambda robot: robot.controllers.cleanup(name))
            node.cleanup()

    def unload(self, name: str) -> None:
        """Unload a controller; errors as :meth:`configure`."""
        node = self._get(name)
        with self._lock:
            if node.sent is not None:
                self._bridge.owner.command(lambda robot: robot.controllers.unload(name))
            self._remove(name)

    def take(self, sample: m.ControllersSample) -> None:
        """Publish what a sample has of the active controllers, and report ends of goals."""
        known, self._ended = self._ended, frozenset(each.goal for each in sample.ended)
        for ended in sample.ended:
            node = self._nodes.get(ended.controller)
            if node is not None and ended.goal not in known:
                node.report(ended)
        for name in sample.active:
            node = self._nodes.get(name)
            if node is not None:
                node.take(sample)

    def follow(self) -> m.ControllerList:
        """Remove the controllers that the owner does not have any more; return those it has.

        Raises:
            OwnerLostError: There is no owner.
        """
        with self._lock:
            listing = self._bridge.owner.controllers()
            present = {each.name for each in listing.controllers}
            for name, node in tuple(self._nodes.items()):
                if node.sent is not None and name not in present:
                    self._remove(name)
            return self.listing(listing)

    def listing(self, listing: m.ControllerList) -> m.ControllerList:
        """Return the owner's list with the controllers of this node alone.

        Those that wait for parameters, which the owner does not have, are unconfigured.
        """
        waiting = tuple(
            m.ControllerValue(name, node.kind, "unconfigured", 0.0, (), (), ())
            for name, node in tuple(self._nodes.items())
            if node.sent is None
        )
        own = (each for each in listing.controllers if each.name in self._nodes)
        return msgspec.structs.replace(listing, controllers=(*own, *waiting))

    def unanswered(self) -> m.ControllerList:
        """Return a list for when the owner does not answer: the states are unknown.

        The controllers of an owner that was lost have ended with it.
        """
        values = (
            m.ControllerValue(name, node.kind, "unknown", 0.0, (), (), ())
            for name, node in tuple(self._nodes.items())
            if node.sent is not None and self._bridge.owner.connected
        )
        return m.ControllerList(tuple(values), (), ())

    def shut_down(self) -> None:
        """Deactivate and unload all controllers.

        Raises:
            BioscaraError: The owner refuses it, or there is none.
        """
        with self._lock:
            listing = self.follow().controllers
            active = [each.name for each in listing if each.state == "active"]
            leaving = [name for name in active if name in self._nodes]
            if leaving:
                self._bridge.owner.command(
                    lambda robot: robot.controllers.switch((), leaving, strict=False)
                )
            for name in self.names:
                self.unload(name)

    def close(self) -> None:
        """End all nodes."""
        with self._lock:
            for name in self.names:
                self._remove(name)

    def _remove(self, name: str) -> None:
        node = self._nodes.pop(name)
        self._bridge.owner.own.discard(name)
        node.close()

    def _get(self, name: str) -> ControllerNode:
        if name not in self._nodes:
            loaded = ", ".join(self._nodes) or "none"
            raise SwitchError(f"no controller named {name} is loaded; there are: {loaded}")
        return self._nodes[name]

    def _load(self, robot: RemoteRobot, node: ControllerNode) -> None:
        """Let the owner load a controller with its present parameters."""
        values = self._for_owner(node)
        robot.controllers.load(node.name, node.kind, values)
        node.sent = values
        self._bridge.owner.own.add(node.name)

    def _update(self, robot: RemoteRobot, node: ControllerNode) -> None:
        """Let the owner have the present parameters of a controller, unless it is active."""
        if node.sent is None:
            self._load(robot, node)
            return
        values, before = self._for_owner(node), node.sent
        states = {each.name: each.state for each in robot.controllers.list().controllers}
        if values == before or states.get(node.name) == "active":
            return
        robot.controllers.unload(node.name)
        try:
            robot.controllers.load(node.name, node.kind, values)
        except BioscaraError:
            robot.controllers.load(node.name, node.kind, before)
            raise
        node.sent = values

    def _for_owner(self, node: ControllerNode) -> dict[str, Any]:
        given = node.parameters()
        if fallbacks := self._bridge.parameter(f"{node.name}.fallback_controllers"):
            given["fallback_controllers"] = fallbacks
        return parameters.for_owner(node.kind, given, self._bridge.description)

    def _arguments(self, name: str) -> list[str]:
        """Return the arguments of a controller's node: its files, then others."""
        files = self._bridge.parameter(f"{name}.params_file") or []
        files = [files] if isinstance(files, str) else files
        others = self._bridge.parameter(f"{name}.node_options_args") or []
        words = [word for file in files for word in ("--params-file", file)]
        return [*words, *(word for word in others if word not in ("--ros-args", "--"))]
