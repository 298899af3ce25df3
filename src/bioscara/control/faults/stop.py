"""Bringing the joints of an arm to rest, and detecting that they rest."""

from __future__ import annotations

from contextlib import suppress

from bioscara.control.controllers.controller import AnyController
from bioscara.control.controllers.hold_controller import HoldController
from bioscara.control.controllers.jog_controller import JogController
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController
from bioscara.control.manager.manager import ControllerManager
from bioscara.errors import ModeSwitchError
from bioscara.hardware import HOME, ArmHardware, LifecycleState

STANDING = 0.002
"""Share of its highest speed below which a joint counts as standing."""
_REST_TIME = 5.0
"""Time after which a stop counts as ended regardless of the joints' states [s]."""
_STOPPABLE = JointTrajectoryController, JogController
"""Controllers that come to rest on their current path."""


class MotionStopper:
    """Takes the joints of an arm from the controllers that move them.

    Args:
        manager: Runs the arm.
        arm: Its joints.
        hold: Name of the configured controller that brings the arm to rest and holds it.
    """

    def __init__(self, manager: ControllerManager, arm: ArmHardware, hold: str) -> None:
        self._manager, self._arm, self._hold = manager, arm, hold

    def at_rest(self, time: float, since: float) -> bool:
        """Return whether all joints that can be reached stand, or had long enough to do so.

        False in the cycle of the stop command itself: its state is part of the evidence.

        Args:
            time: Now [s].
            since: Time of the stop command [s].
        """
        if time <= since:
            return False
        if self._arm.state is not LifecycleState.ACTIVE or time - since > _REST_TIME:
            return True
        hold = self._manager.controller(self._hold)
        if (
            isinstance(hold, HoldController)
            and hold.state is LifecycleState.ACTIVE
            and not hold.ended
        ):
            return False
        return all(
            axis.halted is not None
            or (
                not axis.homing.running
                and abs(axis.sample.velocity) < STANDING * axis.velocity_limit
            )
            for axis in self._arm.axes
        )

    def stop_on_path(self, time: float) -> bool:
        """Bring all motion to rest on its path; return False if some of it cannot be.

        Args:
            time: Now [s].
        """
        moving = self._moving()
        stoppable = [each for each in moving if isinstance(each, _STOPPABLE)]
        if not stoppable or len(stoppable) < len(moving):
            return False
        for controller in stoppable:
            controller.cancel(time)
        return True

    @property
    def stopped_on_path(self) -> bool:
        """Whether no motion is still coming to rest on its path."""
        return all(each.at_rest for each in self._moving() if isinstance(each, _STOPPABLE))

    def hold(self, time: float) -> None:
        """Bring all joints to rest and hold them; end a homing run.

        Args:
            time: Now [s].

        Raises:
            BioscaraError: A controller could not be switched off.
        """
        manager, arm = self._manager, self._arm
        if arm.state is not LifecycleState.ACTIVE:
            return
        for command in arm.commands.values():
            if command.kind == HOME:
                command.value = 0.0
        leaving, moving = [], False
        for controller in manager.controllers:
            claimed = arm.commands.keys() & controller.command_interfaces
            if (
                claimed
                and controller.state is LifecycleState.ACTIVE
                and controller.name != self._hold
            ):
                leaving.append(controller.name)
                moving = moving or any(arm.commands[name].kind != HOME for name in claimed)
        if moving and manager.controller(self._hold).state is not LifecycleState.ACTIVE:
            # Where a moving joint cannot be held, each comes to rest on its own.
            with suppress(ModeSwitchError):
                manager.take_over(self._hold, leaving, time)
                return
        if leaving:
            manager.switch(time, (), leaving)

    def _moving(self) -> list[AnyController]:
        own = self._arm.commands.keys()
        return [
            each
            for each in self._manager.controllers
            if each.state is LifecycleState.ACTIVE and own & each.command_interfaces
        ]
