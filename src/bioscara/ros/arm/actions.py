"""Actions that ros2_control does not have: planned motions of the tool."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bioscara_interfaces.action import MoveNamed, MoveToPose
from rclpy.action import ActionServer, CancelResponse

from bioscara.errors import BioscaraError
from bioscara.ros.arm.services import FOLDER, pose_of, scalings
from bioscara.ros.bridge import Bridge

_PERIOD = 0.05
"""Time between two messages of feedback [s]."""


class ArmActions:
    """Offers the actions."""

    def __init__(self, bridge: Bridge) -> None:
        self._bridge = bridge
        self._serve(MoveToPose, "move_to_pose", _begin_move_to)
        self._serve(MoveNamed, "move_named", _begin_move_named)

    def _serve(self, kind: Any, name: str, begin: Callable[[Any, Any], Any]) -> None:
        def execute(handle: Any) -> Any:
            result = kind.Result()
            try:
                self._bridge.owner.command(lambda robot: self._run(handle, kind, begin, robot))
            except BioscaraError as error:
                result.code, result.message = error.code, str(error)
                if handle.is_cancel_requested:
                    handle.canceled()
                else:
                    handle.abort()
                return result
            result.success = True
            handle.succeed()
            return result

        ActionServer(
            self._bridge.node,
            kind,
            f"{FOLDER}/{name}",
            execute,
            callback_group=self._bridge.parallel,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    def _run(self, handle: Any, kind: Any, begin: Callable[[Any, Any], Any], robot: Any) -> None:
        """Carry a motion out; raises its error."""
        motion = begin(robot, handle.request)
        cancelled = False
        while not motion.wait(_PERIOD):
            handle.publish_feedback(kind.Feedback(progress=motion.progress))
            if handle.is_cancel_requested and not cancelled:
                cancelled = True
                motion.cancel()
        motion.result()


def _begin_move_to(robot: Any, goal: Any) -> Any:
    method = robot.move_linear if goal.linear else robot.move_to
    return method(pose_of(goal.pose), **scalings(goal), wait=False)


def _begin_move_named(robot: Any, goal: Any) -> Any:
    return robot.move_named(goal.name, **scalings(goal), wait=False)
