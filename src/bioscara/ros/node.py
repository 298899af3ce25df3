"""The node: waits for a description and an owner, then offers everything."""

from __future__ import annotations

import itertools
import os
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib.util import find_spec
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, ShutdownException
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String

from bioscara.api import messages as m
from bioscara.errors import BioscaraError, ConfigurationError, HardwareError, OwnerLostError
from bioscara.physics.camera import CameraView
from bioscara.remote.remote_robot import RemoteRobot
from bioscara.ros.arm.camera_images import CameraImages
from bioscara.ros.arm.description import RobotDescription
from bioscara.ros.arm.robot_frames import DESCRIPTION, LATCHED, RobotFrames
from bioscara.ros.arm.world_frames import WorldFrames
from bioscara.ros.arm_time import ArmTime
from bioscara.ros.bridge import Bridge
from bioscara.ros.controllers.loaded import LoadedControllers
from bioscara.ros.controllers.manager_services import ManagerServices
from bioscara.ros.controllers.parameter_sections import sections
from bioscara.ros.controllers.parameters import without_effect
from bioscara.ros.executor import NodeExecutor
from bioscara.ros.observation import Observation
from bioscara.ros.owner import OwnerConnection
from bioscara.ros.owner_process import OwnerProcess

NAME = "controller_manager"
_THREADS = 16
"""Threads for callbacks: each goal that runs keeps one."""
_WAIT = 0.5
"""Longest wait for a callback [s]: the wake-up by the end of another one can be lost."""
_POLL = 0.05
"""Period of the check for a request to end [s]."""
_REMIND = 100
"""Checks between two messages that something is missing."""


class ControllerManagerNode:
    """The node ``controller_manager`` with its services, topics and controllers.

    Args:
        arm: Name of the owner.
        arguments: Arguments of ROS: ``--ros-args`` and the words after it.
        description: The robot description where no parameter has one; empty to wait for the topic.
        view: Camera and size of images of the simulated world; None for none.

    Attributes:
        node: The node.

    Raises:
        ConfigurationError: ROS refuses the arguments, or the description in the parameter cannot be
            used.
    """

    def __init__(
        self,
        arm: str,
        arguments: Sequence[str],
        description: str = "",
        view: CameraView | None = None,
    ) -> None:
        self._context = rclpy.Context()
        try:
            rclpy.init(
                args=list(arguments),
                context=self._context,
                signal_handler_options=SignalHandlerOptions.NO,
            )
            self.node = Node(
                NAME,
                context=self._context,
                allow_undeclared_parameters=True,
                automatically_declare_parameters_from_overrides=True,
            )
        except Exception as error:
            # Of rclpy, for arguments and files that it cannot read.
            text = str(error).partition(", at ")[0]
            raise ConfigurationError(f"ROS refuses the arguments: {text}") from error
        # Read now: files of launch may be gone when a controller is loaded.
        self._sections = sections(arguments)
        self._log = self.node.get_logger()
        self._executor = NodeExecutor(_THREADS, self._context, self._callback_failed)
        self._executor.add_node(self.node)
        self._time = ArmTime(self._simulated_time)
        client = f"{self.node.get_fully_qualified_name()}[{os.getpid()}]"
        self._owner = OwnerConnection(arm, client, self._take, self._listed, self._changed)
        self._bridge: Bridge | None = None
        self._frames: RobotFrames | None = None
        self._world = WorldFrames(self.node, self._time)
        self._images: CameraImages | None = None
        if view is not None:
            self._images = CameraImages(self.node, self._time, self._owner, view)
        self._loaded: LoadedControllers | None = None
        self._observation: Observation | None = None
        self._description: RobotDescription | None = None
        self._compared_with: RemoteRobot | None = None
        self._ending, self._silence = False, ""
        self._spinning = threading.Thread(target=self._spin, name="bioscara-ros-spin", daemon=True)
        parameters = self.node.get_parameters_by_prefix("")
        for text in without_effect({name: each.value for name, each in parameters.items()}):
            self._log.warning(text)
        if given := self.parameter(DESCRIPTION) or description:
            self._description = RobotDescription(str(given))
            self._frames = RobotFrames(self.node, self._description, self._time)
        self.node.create_subscription(String, DESCRIPTION, self._hear_description, LATCHED)

    def parameter(self, name: str) -> Any:
        """Return a parameter of the manager; None if it is not given."""
        found = self.node.get_parameter_or(name, None)
        return None if found is None else found.value

    def run(self, ended: Callable[[], bool], process: OwnerProcess | None = None) -> None:
        """Run until ``ended`` returns true, or ROS is shut down; then deactivate everything.

        Args:
            ended: Returns whether to end.
            process: The owner, if this program has started it: the node uses no other one, and ends
                with it; None for that of another program.

        Raises:
            HardwareError: That owner has ended.
            ConfigurationError: The description contradicts the parameters of the arm.
        """
        self._spinning.start()
        self._owner.start(None if process is None else process.pid)
        if self._images is not None:
            self._images.start()
        try:
            for number in itertools.count(1):
                if ended() or not self._context.ok():
                    break
                if process is not None:
                    self._check(process)
                self._end_goals_in_silence()
                description = self._compared()
                if description is not None and self._bridge is None:
                    self._offer(description)
                if number % _REMIND == 0:
                    self._remind()
                time.sleep(_POLL)
        finally:
            self._close()

    def _check(self, process: OwnerProcess) -> None:
        """Raise HardwareError if the owner that this program started has ended, with its goals."""
        try:
            process.check()
        except HardwareError as error:
            self._changed(str(error))
            raise

    def _end_goals_in_silence(self) -> None:
        """End the goals of an owner that has been silent for longer than its lease lasts.

        It has stopped the arm, or is not there any more; where it goes on, the lease has lapsed.
        """
        former, self._silence = self._silence, self._owner.silence
        if self._silence and not former and self._bridge is not None:
            self._log.error(f"all goals are aborted: {self._silence}")
            self._bridge.goals.lose(self._silence)

    def _spin(self) -> None:
        while self._context.ok() and not self._ending:
            try:
                self._executor.spin_once(timeout_sec=_WAIT)
            except (ExternalShutdownException, ShutdownException):
                return
            except Exception as error:  # noqa: BLE001  of one entity: the others go on
                self._callback_failed(error)

    def _callback_failed(self, error: BaseException) -> None:
        self._log.error(f"a callback has failed: {error!r}")

    def _simulated_time(self) -> float | None:
        clock = self.node.get_clock()
        return 1e-9 * float(clock.now().nanoseconds) if clock.ros_time_is_active else None

    def _hear_description(self, message: Any) -> None:
        if self._description is None:
            try:
                self._description = RobotDescription(message.data)
            except ConfigurationError as error:
                self._log.error(f"the description on the topic cannot be used: {error}")
        elif message.data != self._description.text:
            self._log.warning(
                "another robot_description was published and is ignored; start the node anew to "
                "use it"
            )

    def _compared(self) -> RobotDescription | None:
        """Return the description, compared with the parameters of the owner that is there now.

        Raises:
            ConfigurationError: The description that the node has or was started with contradicts
                them.
        """
        description = self._description
        if description is None or not self._owner.connected:
            return None
        try:
            robot = self._owner.robot
            if robot is not self._compared_with:
                for text in description.compare(robot.parameters):
                    self._log.warning(text)
                self._compared_with = robot
        except OwnerLostError:
            return None
        except ConfigurationError as error:
            if self._bridge is not None or self._frames is not None:
                raise
            self._log.error(f"the description on the topic cannot be used: {error}")
            self._description = None
            return None
        return description

    def _offer(self, description: RobotDescription) -> None:
        """Create the services, now that there are a description and an owner."""
        bridge = Bridge(
            self.node, self._executor, description, self._owner, self._time, self._sections
        )
        self._loaded = LoadedControllers(bridge)
        self._observation = Observation(bridge, self._loaded)
        ManagerServices(bridge, self._loaded, self._listed)
        if find_spec("bioscara_interfaces") is None:
            self._log.warning(
                "bioscara_interfaces is not installed: there are no services for plans, named "
                "poses, STOP and faults; build ros/bioscara_interfaces with colcon"
            )
        else:
            # Imported here: not installed on each computer with ROS.
            from bioscara.ros.arm.actions import ArmActions  # noqa: PLC0415
            from bioscara.ros.arm.services import ArmServices  # noqa: PLC0415

            ArmServices(bridge)
            ArmActions(bridge)
        self._bridge = bridge
        # Those of the owner may have been listed before there was a description. An owner that is
        # lost is listed when it is back.
        with suppress(OwnerLostError):
            self._listed()
        names = ", ".join(component.name for component in description.components)
        self._log.info(f"controls {names} of arm {self._owner.name}")

    def _remind(self) -> None:
        """Report a missing description or owner, and a second node of the same name."""
        if self._description is None:
            self._log.warning(
                "waiting for robot_description, as a parameter or on the topic of that name"
            )
        if not self._owner.connected:
            self._log.warning(f"waiting: {self._owner.reason}")
        own = (self.node.get_name(), self.node.get_namespace())
        if self.node.get_node_names_and_namespaces().count(own) > 1:
            self._log.error(
                f"another node is named {self.node.get_fully_qualified_name()}: clients reach any "
                "of the two; end one, or give it a namespace"
            )

    def _take(self, sample: m.ControllersSample) -> None:
        """Publish a sample; an error does not keep the next ones back."""
        try:
            self._publish(sample)
        except Exception as error:  # noqa: BLE001  of rclpy, where the node ends at the same time
            self._log.error(f"a sample was not published: {error!r}", throttle_duration_sec=1.0)

    def _publish(self, sample: m.ControllersSample) -> None:
        self._time.update(sample.time, sample.wall)
        if self._frames is not None:
            self._frames.take(sample)
        if self._bridge is not None and self._loaded is not None:
            self._bridge.goals.take(sample.ended)
            self._loaded.take(sample)
        with suppress(OwnerLostError):
            self._world.take(self._owner.robot.simulation)

    def _listed(self) -> None:
        """Follow a change of controllers or hardware."""
        if self._loaded is not None and self._observation is not None:
            self._observation.follow()

    def _changed(self, reason: str | None) -> None:
        """Follow the loss of the owner, or its return."""
        if reason is None:
            rate, wanted = round(1.0 / self._owner.robot.period), self.parameter("update_rate")
            self._log.info(f"connected to the owner of {self._owner.robot.description}")
            if wanted is not None and wanted != rate:
                self._log.warning(
                    f"update_rate {wanted} Hz: the owner of the arm runs at {rate} Hz"
                )
            return
        self._log.error(reason)
        self._world.lose()
        if self._bridge is not None and self._loaded is not None and self._observation is not None:
            self._bridge.goals.lose(reason)
            self._loaded.close()
            self._observation.lose()

    def _close(self) -> None:
        """Deactivate and unload the controllers, and end the node."""
        if self._loaded is not None and self._loaded.names:
            try:
                self._loaded.shut_down()
            except BioscaraError as error:
                self._log.error(f"the controllers were not unloaded: {error}")
            self._loaded.close()
        if self._images is not None:
            self._images.close()
        self._owner.close()
        # In this order ROS informs the others that the node has ended; a program that only exits is
        # taken to be there for 20 s more.
        self._ending = True
        self._executor.wake()
        self._spinning.join(2.0)
        if self._bridge is not None:
            self._bridge.goals.lose("the node has ended")
        self._executor.shutdown(timeout_sec=1.0)
        self.node.destroy_node()
        self._context.try_shutdown()
        self._context.destroy()
