"""Random switches between controllers of a moving arm, and the limits that they must keep."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from typing import NamedTuple

from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.controllers.joint_trajectory import (
    JointTrajectory,
    JointTrajectoryController,
    Point,
)
from bioscara.hardware import LifecycleState, Mode
from control.control_stack import BOTH, NAMES, PARAMETERS, World

_FORWARD = "forward_command_controller/ForwardCommandController"
_TRAJECTORY = "joint_trajectory_controller/JointTrajectoryController"
_ROUNDING = 1.0 + 1e-6
CHOICES = ("position", "velocity", "jtc both", "jtc position", "hold", "off")


class Outcome(NamedTuple):
    """Result of a run; steps are shares of a joint's limit per cycle, worst first.

    Attributes:
        switches: Controllers switched.
        moving: Switches during which a joint was faster than a twentieth of its limit.
        step: Largest step of a setpoint, in units of highest speed times period.
        jump: Largest change of speed, in units of highest acceleration times period, where a
            joint stayed under command.
        outside: Setpoints outside the limits.
    """

    switches: int
    moving: int
    step: float
    jump: float
    outside: int


class Watch:
    """Compares each setpoint with that of the cycle before."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._guards = world.manager.limiter.joints
        self._last = dict.fromkeys(NAMES, math.nan)
        self._speed = dict.fromkeys(NAMES, math.nan)
        self.step = self.jump = 0.0
        self.outside = 0

    def look(self, period: float) -> None:
        """Check the setpoints of the cycle that just ended."""
        for axis in self._world.hardware.axes:
            limits, name = axis.joint.parameters, axis.name
            fastest, strongest = limits.max_velocity * period, limits.max_acceleration * period
            if axis.mode in (Mode.TRACK, Mode.POSITION):
                sent = axis.previous
                last = self._last[name]
                before = axis.position.value if math.isnan(last) else last
                self.step = max(self.step, abs(sent - before) / fastest)
                self.outside += not limits.lower <= sent <= limits.upper
                speed = (sent - last) / period
                self._last[name] = sent
            elif axis.mode is Mode.VELOCITY:
                speed = axis.velocity_command.value
                self.step = max(self.step, abs(speed) / limits.max_velocity)
                self._last[name] = math.nan
            else:
                speed = self._last[name] = math.nan
            change = abs(speed - self._speed[name]) / strongest
            if not math.isnan(change):
                self.jump = max(self.jump, change)
            self._speed[name] = speed


def switch_at_random(count: int, seed: int) -> Outcome:
    """Home an arm and switch its controllers at random times, in motion or at rest."""
    # Commands to and fro are sometimes in step with the swing of j3's belt for some periods. At
    # half its acceleration it stalls once in some 100,000 switches, under any controller.
    joints = [
        replace(
            joint,
            max_acceleration=(0.35 if joint.name == "j3" else 0.5) * joint.max_acceleration,
        )
        for joint in PARAMETERS.joints
    ]
    world = World(at={"j1": 0.0, "j2": 0.17, "j3": 0.0, "j4": 0.0}, frequency=None, joints=joints)
    dice, manager = random.Random(seed), world.manager
    for kind in ("position", "velocity"):
        world.load(kind, _FORWARD, joints=NAMES, interface_name=kind)
    for name, kinds in (("jtc both", BOTH), ("jtc position", ("position",))):
        world.load(
            name,
            _TRAJECTORY,
            joints=NAMES,
            command_interfaces=kinds,
            state_interfaces=BOTH,
            fallback_controllers=("hold",),
        )
    watch, moving, active = Watch(world), 0, ()
    period, now = 1.0 / world.rate, world.clock.now()
    for _ in range(count):
        name = dice.choice(CHOICES)
        wanted = () if name == "off" else (name,)
        manager.switch(now, wanted, active)
        active = wanted
        _command(world, name, dice, now)
        moving += any(
            abs(axis.velocity.value) > 0.05 * axis.velocity_limit for axis in world.hardware.axes
        )
        for _ in range(dice.choice((1, 1, 1, 2, 3))):
            now += period
            world.clock.sleep_until(now)
            manager.cycle(world.clock.now(), period)
            if manager.failures or world.hardware.problems:
                raise AssertionError((name, manager.failures, world.hardware.problems))
            watch.look(period)
    return Outcome(count, moving, watch.step, watch.jump, watch.outside)


def _command(world: World, name: str, dice: random.Random, now: float) -> None:
    """Command a rough motion, which no planner would."""
    controller = world.manager.controllers
    chosen = next((each for each in controller if each.name == name), None)
    goal = [dice.uniform(limit.lower, limit.upper) for limit in PARAMETERS.joints]
    if isinstance(chosen, ForwardCommandController):
        if name == "velocity":
            goal = [dice.uniform(-1.0, 1.0) * limit.max_velocity for limit in PARAMETERS.joints]
        if dice.random() < 0.8:
            chosen.command(goal)
    elif isinstance(chosen, JointTrajectoryController) and dice.random() < 0.8:
        assert chosen.state is LifecycleState.ACTIVE
        points = (Point(dice.uniform(0.02, 3.0), tuple(goal)),)
        chosen.send_trajectory(JointTrajectory(NAMES, points), now)
