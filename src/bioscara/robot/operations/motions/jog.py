"""Motion by streamed velocities."""

from __future__ import annotations

import math
from collections.abc import Callable

from bioscara.arguments import shown
from bioscara.errors import InvalidArgumentError
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity
from bioscara.report import Phase
from bioscara.robot.arm import Arm
from bioscara.robot.connection.stack import JOG
from bioscara.robot.operations.execution import SETTLING, MotionExecution, ready
from bioscara.robot.operations.operation import Cycles, OnCycle, Operation
from bioscara.robot.planner import Planner

Velocity = JointVelocity | ToolVelocity
"""Commanded velocity of a jog."""


class Jog(Operation[None]):
    """Moves by velocities until their source ends, and then until the arm is at rest.

    Args:
        velocities: Called each cycle: returns a velocity, or None to end; raises to end early.
        settling: Time at rest after which it ends [s].
        timeout: Longest duration [s]; None for no limit.
        on_cycle: Receives the record of each cycle.

    Attributes:
        velocities: As given.

    Raises:
        InvalidArgumentError: ``velocities`` cannot be called.
    """

    pausable = True

    def __init__(
        self,
        velocities: Callable[[], Velocity | None],
        *,
        settling: float = SETTLING,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
    ) -> None:
        super().__init__("jog()", timeout=timeout, on_cycle=on_cycle)
        if not callable(velocities):
            raise InvalidArgumentError(
                f"jog() is given {shown(velocities)}; give a function that returns the velocity, "
                "or None to end"
            )
        self.velocities, self._settling = velocities, settling

    def prepare(self, arm: Arm) -> None:
        """Check that the arm may be jogged from where it is."""
        planner = Planner(arm.workspace, arm.positions)
        planner.jog(planner.here())
        if (remedy := arm.pause_remedy(self)) is not None:
            arm.warn(
                f"{self.name} begins paused: its velocities move nothing before {remedy}",
                *self.caller,
            )

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Pass the velocities to the jog controller."""
        stack, clock = arm.stack, arm.session.clock
        yield from ready(arm, self)
        guards = stack.manager.limiter.joints
        planner = Planner(arm.workspace, arm.positions)
        here = [guards[name].here for name in planner.joint_names]
        stack.jog.jog = jog = planner.jog(here, elbow=arm.bent_elbow)
        stack.use(JOG, clock.now())
        ended, since = False, math.inf

        def done() -> bool:
            nonlocal ended, since
            if not ended:
                self._limitation = jog.limitation
            now, velocity = clock.now(), None if ended else self.velocities()
            ended = velocity is None
            if velocity is None:
                # At once: the last command would otherwise apply until it expires.
                stack.jog.cancel(now)
            else:
                stack.jog.command(velocity, now, arm.speed_of(self))
            since = min(since, now) if ended and stack.jog.at_rest else math.inf
            return now - since >= self._settling

        yield from MotionExecution(arm, self).run(done, Phase.JOG)
