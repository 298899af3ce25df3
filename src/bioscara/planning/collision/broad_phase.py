"""Broad phase: exclude pairs that are too far apart to collide on a short motion."""

from __future__ import annotations

import math

import numpy as np

from bioscara.kinematics import Scara
from bioscara.planning.arrays import Array
from bioscara.planning.collision.scene_pairs import Layout

_AHEAD = 0.03
"""Look-ahead distance for short motions that are checked in every cycle [m]."""


class BroadPhase:
    """The pairs of a layout that may come near each other during motions of an arm.

    They are selected by their clearances when all pairs were last evaluated. The selection is valid
    until the arm has moved a certain distance from there.

    Args:
        kinematics: The arm.
        layout: The pairs.
        margin: Clearance above which a pair is irrelevant [m].
        ahead: Distance added to the required one when all pairs are evaluated, so that the result
            also covers the next motions [m].

    Attributes:
        reach: As in the layout.
    """

    def __init__(
        self, kinematics: Scara, layout: Layout, margin: float, ahead: float = _AHEAD
    ) -> None:
        self._kinematics, self._layout, self._margin = kinematics, layout, margin
        self._ahead = ahead
        self.reach = layout.reach
        self._joints = np.full(len(layout.reach), math.nan)
        self._range = -math.inf
        self._near: Layout | None = None

    def free_distance(self, here: Array) -> Array:
        """Return how far any point of the arm may move without a new evaluation of all pairs [m].

        Args:
            here: Joints at the start [rad, m, rad, rad], shape (..., 4).
        """
        free: Array = self._range - np.abs(here - self._joints) @ self.reach
        return free

    def candidates(self, here: Array, distance: float) -> Layout | None:
        """Return a superset of the pairs that may be nearer than the margin on some motions.

        Args:
            here: Joints where the motions begin [rad, m, rad, rad], shape (4,).
            distance: Longest path of any point of the arm on any of them [m].

        Returns:
            The pairs, each with the parts that may be so near; None if there are none.
        """
        if self._layout.pairs and not distance <= self.free_distance(here):
            self._evaluate(here, distance + self._ahead)
        return self._near

    def _evaluate(self, here: Array, distance: float) -> None:
        self._near, nearest = self._layout.near(self._kinematics, here, self._margin + distance)
        self._joints = here
        self._range = nearest - self._margin if self._near is None else distance
