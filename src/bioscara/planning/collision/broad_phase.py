"""Which pairs are worth a look on short ways: what is far apart cannot come near on them."""

from __future__ import annotations

import math

import numpy as np

from bioscara.kinematics import Scara
from bioscara.planning.collision.scene_pairs import Layout
from bioscara.planning.collision.shapes import Array

_AHEAD = 0.03
"""How far ahead a look goes for ways that are short and looked at in every cycle [m]."""


class Nearby:
    """The pairs of a layout that may come near to each other on ways of an arm.

    From how far apart all of them were when they were looked at last follows which matter until
    the arm has moved on.

    Args:
        arm: The arm.
        layout: The pairs.
        margin: What is at least so far apart does not matter [m].
        ahead: How much farther than it must a look at all pairs goes, to be good for the next ways,
            too [m].

    Attributes:
        reach: As that of the layout.
    """

    def __init__(self, arm: Scara, layout: Layout, margin: float, ahead: float = _AHEAD) -> None:
        self._arm, self._layout, self._margin = arm, layout, margin
        self._ahead = ahead
        self.reach = layout.reach
        self._place = np.full(len(layout.reach), math.nan)
        self._range = -math.inf
        self._near: Layout | None = None

    def free(self, here: Array) -> Array:
        """Return how far a point of the arm may go until :meth:`on` has to look again [m].

        Args:
            here: Where from [rad, m, rad, rad], shape (..., 4).
        """
        free: Array = self._range - np.abs(here - self._place) @ self.reach
        return free

    def on(self, here: Array, way: float) -> Layout | None:
        """Return pairs among which are all that may be nearer than the margin on some ways.

        Args:
            here: Where the ways begin [rad, m, rad, rad], shape (4,).
            way: How far a point of the arm goes at most on any of them [m].

        Returns:
            The pairs, with those of their parts that may be so near; None where there are none.
        """
        if self._layout.pairs and not way <= self.free(here):
            self._look(here, way + self._ahead)
        return self._near

    def _look(self, here: Array, way: float) -> None:
        self._near, nearest = self._layout.near(self._arm, here, self._margin + way)
        self._place = here
        self._range = nearest - self._margin if self._near is None else way
