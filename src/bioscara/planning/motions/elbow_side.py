"""The side to which the elbow is bent, and tool velocities where it is straight or folded.

There the wrist can only move on a circle about the column: its distance from the column is at its
end. Next to that pose the elbow would have to turn infinitely fast to change the distance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from bioscara.kinematics import Joints, Scara
from bioscara.planning.limits import JointLimits

BENT = 0.02
"""Elbow angle from straight or folded that tool velocities keep [rad], and from which on an elbow
counts as bent: the wrist is 30 um from the end of its reach there."""
ELBOW = 2
"""Number of the elbow's joint, from 0."""
_STRAIGHT = 1e-3
"""Elbow angle from straight or folded below which the former side applies [rad]. Velocities of the
tool are those of this angle there, where the wrist is 0.1 um from the end of its reach."""
_NEAR = 0.1
"""Elbow angle from straight or folded below which x and y are limited apart from z, yaw [rad]."""


def bent(elbow: float) -> bool:
    """Return whether an elbow is bent to a side.

    Args:
        elbow: Position of the elbow [rad]; NaN if it is unknown.
    """
    # No position is known before homing.
    return math.isfinite(elbow) and abs(math.remainder(elbow, math.pi)) > BENT


class ElbowSide:
    """The half turn of the elbow, from straight to folded, in which tool velocities keep it.

    Args:
        kinematics: The arm.
        limits: Of its joints.
        joints: Positions of the joints [rad, m, rad, rad].
        before: A position in which the elbow was bent last [rad]; None if it is unknown. Then an
            elbow that is exactly straight or folded bends to where its joint and j1, which turns
            against it, have more room to their limits; to the positive side if they have the same.
    """

    def __init__(
        self,
        kinematics: Scara,
        limits: Sequence[JointLimits],
        joints: Joints,
        before: float | None = None,
    ) -> None:
        self._l1, self._l2, _ = kinematics.geometry
        half_turns = round(joints.j3 / math.pi)
        if before is not None and math.floor(before / math.pi) in {half_turns - 1, half_turns}:
            self._side = math.floor(before / math.pi)
        elif joints.j3 != half_turns * math.pi:
            self._side = math.floor(joints.j3 / math.pi)
        else:
            turn, elbow = limits[0], limits[2]
            lower, upper = joints.j1 - turn.lower, turn.upper - joints.j1
            if half_turns % 2:
                lower, upper = upper, lower
            up = min(elbow.upper - joints.j3, lower) >= min(joints.j3 - elbow.lower, upper)
            self._side = half_turns if up else half_turns - 1
        self._range = (0.0, 0.0)
        self.follow(joints.j3, free=True)

    @property
    def range(self) -> tuple[float, float]:
        """Positions in which the elbow is bent, or no nearer to straight than it was [rad]."""
        return self._range

    def follow(self, elbow: float, *, free: bool) -> None:
        """Take the position to which a motion has brought the elbow.

        Args:
            elbow: The position [rad].
            free: Whether velocities of joints moved it, which may change its side.
        """
        side = math.floor(elbow / math.pi)
        if side != self._side and abs(math.remainder(elbow, math.pi)) > _STRAIGHT:
            self._side, free = side, True
        if free:
            begin = self._side * math.pi
            self._range = min(elbow, begin + BENT), max(elbow, begin + math.pi - BENT)

    def ends(self, elbow: float, velocity: float) -> bool:
        """Return whether a velocity turns the elbow to the nearer end of its range.

        Args:
            elbow: Its position [rad].
            velocity: Its velocity [rad/s].
        """
        return (elbow < (self._side + 0.5) * math.pi) == (velocity < 0.0)

    def regular(self, joints: Sequence[float]) -> Sequence[float]:
        """Return the joints, with the elbow bent a little where it is straight or folded.

        Bearing of the wrist and yaw of the tool are kept, so that velocities of the tool are, too.

        Args:
            joints: Positions of the joints [rad, m, rad, rad].
        """
        q1, q2, q3, q4 = joints
        begin = self._side * math.pi
        elbow = min(max(q3, begin + _STRAIGHT), begin + math.pi - _STRAIGHT)
        if elbow == q3:
            return joints
        first = q1 + self._bearing(q3) - self._bearing(elbow)
        return first, q2, elbow, q4 + q1 + q3 - first - elbow

    def _bearing(self, elbow: float) -> float:
        """Return the bearing of the wrist from the upper arm [rad]."""
        return math.atan2(self._l2 * math.sin(elbow), self._l1 + self._l2 * math.cos(elbow))

    @staticmethod
    def near(elbow: float) -> bool:
        """Return whether the elbow is so nearly straight or folded that x and y are limited alone.

        Args:
            elbow: Its position [rad].
        """
        return abs(math.remainder(elbow, math.pi)) < _NEAR

    @staticmethod
    def folded(elbow: float) -> bool:
        """Return whether the elbow is nearer to folded than to straight.

        Args:
            elbow: Its position [rad].
        """
        return math.cos(elbow) < 0.0
