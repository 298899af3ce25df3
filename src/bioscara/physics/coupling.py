"""One step of a world, as the simulated arm calls it; it does not know the arm."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from bioscara.errors import BioscaraError
from bioscara.physics.engine import mujoco
from bioscara.physics.servo_force import ServoForce
from bioscara.physics.world_model import SLICE
from bioscara.planning.arrays import Array

_FREE = 6
"""Degrees of freedom of a body that moves freely."""
_WAKING = 1e-12
"""A torque that nothing notices [N m]."""
_CHECK = 20
"""Slices from one look at the engine's warnings to the next."""
Disturbance = Callable[[Any, Array], bool]
"""Changes the engine's data, and the torques on the joints, before or after a step; returns whether
it goes on."""


class Coupling:
    """Steps a model of a world.

    Args:
        model: A ``mujoco.MjModel``; its first four joints are the arm's.
        data: Its ``mujoco.MjData``.
        servo: Moves its jaws.

    Attributes:
        model: The model.
        data: Its state.
        servo: Moves the jaws.
        contact: Torques of bodies on the joints [N m, N, N m, N m], shape (4,).
        before: Disturbances that act before a step.
        after: Disturbances that act on the joints, after it.
    """

    def __init__(self, model: Any, data: Any, servo: ServoForce) -> None:
        self.model, self.data, self.servo = model, data, servo
        self.contact = np.zeros(4)
        self.before: list[Disturbance] = []
        self.after: list[Disturbance] = []
        self._engine = mujoco()
        warnings = self._engine.mjtWarning
        self._bad = [
            int(each)
            for each in (warnings.mjWARN_BADQPOS, warnings.mjWARN_BADQVEL, warnings.mjWARN_BADQACC)
        ]
        self._count = 0
        self._step, self._integrate = self._engine.mj_step, self._engine.mj_integratePos
        self._velocity = np.empty(model.nv)
        self._force = data.qfrc_constraint[:4]

    def step(self) -> None:
        """Let a slice pass.

        Raises:
            BioscaraError: The engine lost the bodies.
        """
        data = self.data
        self.servo.step()
        if self.before:
            self.before = [each for each in self.before if each(data, self.contact)]
        # Contacts as they are in the middle of the slice: with those of its beginning, a plate
        # that is carried round a curve leaves it along the tangent, 0.5 mm in half a metre.
        self._velocity[:] = data.qvel
        self._integrate(self.model, data.qpos, self._velocity, 0.5 * SLICE)
        self._step(self.model, data)
        # Bodies that have fallen asleep stay where they are: a change would wake them.
        self._velocity *= data.qvel != 0.0
        self._integrate(self.model, data.qpos, self._velocity, -0.5 * SLICE)
        self.contact[:] = self._force
        if self.after:
            self.after = [each for each in self.after if each(data, self.contact)]
        self._count += 1
        if self._count % _CHECK == 0 and any(data.warning[each].number for each in self._bad):
            raise BioscaraError(
                f"the bodies around the simulated arm moved too fast to be computed at "
                f"{data.time:.3f} s: the arm goes on without them; look for bodies that overlap, "
                f"or that are much heavier than what they stand on"
            )


def allow_sleep(options: Any, *, allowed: bool) -> None:
    """Let bodies at rest sleep, which are then not computed, or not.

    Args:
        options: Of the model.
        allowed: Whether they may; the engine knows no sleep before version 3.8.
    """
    kind = int(getattr(mujoco().mjtEnableBit, "mjENBL_SLEEP", 0))
    options.enableflags = options.enableflags & ~kind | (kind if allowed else 0)


class BodyPush:
    """A force on a body that moves freely, for a time.

    Args:
        body: Number of the body.
        force: In the base frame [N], shape (3,).
        duration: [s].
    """

    def __init__(self, body: int, force: Array, duration: float) -> None:
        self._body, self._force = body, force
        self._left = max(round(duration / SLICE), 1)

    def __call__(self, data: Any, _: Array) -> bool:
        """Apply it; the last call ends it."""
        self._left -= 1
        data.xfrc_applied[self._body, :3] = self._force if self._left >= 0 else 0.0
        return self._left >= 0


class LinkPush:
    """A force at the origin of a link of the arm, for a time.

    Args:
        model: The model.
        body: Number of the link's body.
        force: In the base frame [N], shape (3,).
        duration: [s].
    """

    def __init__(self, model: Any, body: int, force: Array, duration: float) -> None:
        self._model, self._body, self._force = model, body, force
        self._left = max(round(duration / SLICE), 1)
        self._jacobian = np.zeros((3, model.nv))
        self._engine = mujoco()

    def __call__(self, data: Any, contact: Array) -> bool:
        """Add it to the torques on the joints."""
        self._left -= 1
        self._engine.mj_jacBodyCom(self._model, data, self._jacobian, None, self._body)
        contact += self._force @ self._jacobian[:, :4]
        return self._left > 0


class Tilting:
    """A change of a fixed body's rotation, slow enough for labware that stands on it.

    Args:
        model: The model.
        body: Number of the body.
        rotation: Unit quaternion at the end.
        duration: [s].
    """

    def __init__(self, model: Any, body: int, rotation: Array, duration: float) -> None:
        self._options, self._now, self._end = model.opt, model.body_quat[body], rotation
        self._left = max(round(duration / SLICE), 1)
        self._loose = np.flatnonzero(model.body_dofnum == _FREE)

    def __call__(self, data: Any, _: Array) -> bool:
        """Rotate it by its share of the rest; the last call ends it."""
        going = self._left > 0
        if going:
            self._now += (self._end - self._now) / self._left
            self._now /= np.linalg.norm(self._now)
        # Where bodies may sleep, fixed ones are not placed anew, and labware on this one has to be
        # woken: any force does.
        allow_sleep(self._options, allowed=not going)
        data.xfrc_applied[self._loose, 3] = _WAKING if going else 0.0
        self._left -= 1
        return going
