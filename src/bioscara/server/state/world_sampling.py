"""Samples of the bodies around a simulated arm, taken in the control loop."""

from __future__ import annotations

import math

import numpy as np

from bioscara.api.messages import BodyList, WorldSample
from bioscara.physics.bodies import BodyPose, BodyShape
from bioscara.physics.world import PhysicsWorld
from bioscara.planning.arrays import Array

PERIOD = 0.05
"""Least time between two samples [s], on the arm's clock."""
_DIGITS = 6
"""Decimals of a pose: µm, and about as much at the edge of a plate."""
_MOVED = 1e-5
"""Change of a coordinate [m], or of a part of a quaternion, from which a body has moved: contacts
let bodies at rest creep by less."""


class WorldSampler:
    """Makes samples of a world; all methods are for the thread in which the arm's time passes.

    Args:
        world: The world.
    """

    def __init__(self, world: PhysicsWorld) -> None:
        self._world = world
        self._due = -math.inf
        self._shapes: tuple[BodyShape, ...] = ()
        self._version = 0
        self._list: BodyList
        self._begun: Array
        self._renew()

    @property
    def bodies(self) -> BodyList:
        """The bodies that there are now."""
        self._renew()
        return self._list

    def due(self, time: float) -> bool:
        """Return whether the next sample is due at a time [s]; if so, the one after it is later."""
        # Time may have been set back.
        if self._due - PERIOD <= time < self._due:
            return False
        self._due = time + 0.999 * PERIOD
        return True

    def sample(self, cycle: int, time: float) -> WorldSample:
        """Return where the bodies are.

        Args:
            cycle: Number of the cycle.
            time: Its begin, on the arm's clock [s].
        """
        self._renew()
        poses = self._poses()
        moved = np.flatnonzero((np.abs(poses - self._begun) > _MOVED).any(axis=1)).tolist()
        return WorldSample(
            cycle=cycle,
            time=time,
            version=self._version,
            held=self._world.held,
            width=round(self._world.width, _DIGITS),
            poses=self._named(poses, moved),
        )

    def _renew(self) -> None:
        """Begin a new list if bodies came or went."""
        shapes = self._world.shapes
        if shapes is self._shapes:
            return
        self._shapes, self._version = shapes, self._version + 1
        model = self._world.model
        self._numbers = np.array([model.body(shape.name).id for shape in shapes])
        self._begun = self._poses()
        self._list = BodyList(
            self._version, shapes, self._named(self._begun, list(range(len(shapes))))
        )

    def _poses(self) -> Array:
        """Return x, y, z and the quaternion of each body, shape (n, 7), without a call for each."""
        data, numbers = self._world.data, self._numbers
        poses: Array = np.hstack((data.xpos[numbers], data.xquat[numbers])).round(_DIGITS)
        return poses

    def _named(self, poses: Array, which: list[int]) -> tuple[BodyPose, ...]:
        return tuple(
            [BodyPose(self._shapes[index].name, *poses[index].tolist()) for index in which]
        )
