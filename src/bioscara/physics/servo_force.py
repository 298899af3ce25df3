"""The gripper's servo in a world: pulses in, force of the jaws out."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from bioscara.model import GripperParameters
from bioscara.physics.arm_model import LEFT
from bioscara.physics.world_model import SLICE
from bioscara.sim.servo import SimulatedServo

TORQUE = 0.2
"""Torque at which the servo stalls [N m]: a choice for a small one; 58 N of clamping force for each
N m, by the 3333 degrees a metre of the gripper."""
SPEED = 0.12
"""Speed of the jaws without a load, of both together [m/s]. Estimated."""
FRAME = 20
"""Slices from one look at the pulse to the next: a servo sees a pulse each 20 ms."""
_REACH = SPEED / 2.0 * SLICE
"""Of a jaw in a slice [m]."""


class ServoState(NamedTuple):
    """The state of a servo.

    Attributes:
        slices: Slices until now.
        target: Position to which the jaws are controlled [m].
        goal: Position that the pulses command [m]; None without pulses.
        output: Of the PWM output.
    """

    slices: int
    target: float
    goal: float | None
    output: tuple[str, ...]


class ServoForce:
    """Moves the jaws of a model towards the width that the pulses command.

    The force is limited by the servo; without pulses it is zero, and friction alone holds the jaws.

    Args:
        model: The model, a ``mujoco.MjModel``.
        data: Its ``mujoco.MjData``.
        servo: The simulated servo.
        jaws: Parameters of the gripper.
    """

    def __init__(
        self, model: Any, data: Any, servo: SimulatedServo, jaws: GripperParameters
    ) -> None:
        self._servo, self._jaws = servo, jaws
        self._count, self._target = 0, jaws.initial / 2.0
        self._goal: float | None = None
        self.bind(model, data)

    @property
    def clamp(self) -> float:
        """Largest force between the jaws [N]."""
        return TORQUE * math.radians(self._jaws.deg_per_m)

    @property
    def state(self) -> ServoState:
        """The part of a snapshot."""
        return ServoState(self._count, self._target, self._goal, self._servo.output)

    @state.setter
    def state(self, state: ServoState) -> None:
        self._count, self._target, self._goal, self._servo.output = state
        self._apply()

    def bind(self, model: Any, data: Any) -> None:
        """Drive the jaws of another model and its data."""
        self._force = model.actuator_forcerange
        self._ctrl = data.ctrl
        self._at = data.qpos
        self._address = int(model.joint(LEFT).qposadr[0])
        self._apply()

    def step(self) -> None:
        """Let a slice pass; called before the model's step."""
        if self._count % FRAME == 0:
            pulse = self._servo.pulse()
            goal = None if pulse is None else self._jaws.width_at(pulse) / 2.0
            if goal is not None and self._goal is None:
                # It begins where the jaws are.
                self._target = float(self._at[self._address])
            self._goal = goal
            self._apply()
        self._count += 1
        if self._goal is not None and self._target != self._goal:
            self._target += min(max(self._goal - self._target, -_REACH), _REACH)
            self._ctrl[0] = self._target

    def _apply(self) -> None:
        # The actuator is at the left jaw and moves both.
        most = 0.0 if self._goal is None else 2.0 * self.clamp
        self._force[0] = (-most, most)
        self._ctrl[0] = self._target
