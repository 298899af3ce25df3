"""Closed-form kinematics of the arm: j1 turns the column, j2 lifts, j3 is the elbow, j4 the wrist.

With q13 = q1 + q3 and q134 = q1 + q3 + q4, the flange is at

    x = L1 cos q1 + L2 cos q13,   y = L1 sin q1 + L2 sin q13,   z = h + q2,   yaw = q134

and the tool is a fixed upright frame in it. Single poses are plain floats, which are several times
faster than arrays of four; whole batches are in :mod:`bioscara.kinematics.batch`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from bioscara.arguments import numbers
from bioscara.errors import InvalidArgumentError, UnreachableError
from bioscara.kinematics.joints import Geometry, Joints, PositionLimits
from bioscara.kinematics.pose import (
    ANGLE_MAX,
    IDENTITY,
    TURN,
    Pose,
    require_pose,
    unit_hint,
    wrapped,
)

_SINGULAR = 1e-9
"""Sine of the elbow angle below which the arm is treated as stretched or folded."""
STRETCH_ROUNDING = 1e-12
"""How far the cosine of the elbow angle may exceed 1 by rounding."""
LIMIT_ROUNDING = 1e-9
"""How far a joint may exceed its limit by rounding [rad or m]."""
_SMALL = 1e-3
"""Excess below which four decimals are too few to print it [rad or m]."""
_TURNING = (0, 2, 3)
"""The rotary joints."""


class Scara:
    """The kinematics of one arm with one tool.

    Args:
        geometry: Lengths of the arm.
        limits: Of its joints, j1 to j4.
        tool: Pose of the tool in the flange.
        base: Pose of the arm's base in the frame in which poses are given.
        overhang: Horizontal distance from the tool's point to the farthest point of what the tool
            carries [m].

    Attributes:
        geometry: As given.
        limits: As given.
        tool: As given.
        base: As given.
        overhang: As given.
    """

    def __init__(
        self,
        geometry: Geometry,
        limits: Sequence[PositionLimits],
        tool: Pose = IDENTITY,
        base: Pose = IDENTITY,
        overhang: float = 0.0,
    ) -> None:
        self.overhang = overhang
        self.geometry, self.limits = geometry, tuple(limits)
        self.tool, self.base = tool, base
        self._l1, self._l2, self._height = geometry
        self._to_base = base.inverse()
        # Half of the rounding tolerance is for the solution, the rest for adding its turns.
        slack = 0.5 * LIMIT_ROUNDING
        self._bounds = tuple((limit.lower - slack, limit.upper + slack) for limit in limits)
        self._elbow_turns = max(-self._bounds[2][0], self._bounds[2][1]) >= math.pi
        self._plain_base = base == IDENTITY
        turns = sum(max(-limits[i].lower, limits[i].upper) for i in _TURNING)
        self._most_yaw = max(ANGLE_MAX, turns + abs(tool.yaw) + abs(base.yaw))

    def forward(self, joints: Sequence[float]) -> Pose:
        """Return the pose of the tool; yaw is not wrapped.

        Args:
            joints: j1 to j4 [rad, m, rad, rad].
        """
        q1, q2, q3, q4 = joints
        q13 = q1 + q3
        yaw = q13 + q4
        tx, ty, tz, tyaw = self.tool
        c, s = math.cos(yaw), math.sin(yaw)
        pose = Pose(
            self._l1 * math.cos(q1) + self._l2 * math.cos(q13) + c * tx - s * ty,
            self._l1 * math.sin(q1) + self._l2 * math.sin(q13) + s * tx + c * ty,
            self._height + q2 + tz,
            yaw + tyaw,
        )
        return pose if self._plain_base else self.base.compose(pose)

    def inverse(self, pose: Pose) -> tuple[Joints, Joints]:
        """Return both solutions for a pose: elbow positive first, then elbow negative.

        Angles are wrapped, except where only another turn of one is within its joint's limits.
        Limits are not checked; :meth:`solve` does that.

        Args:
            pose: Of the tool.

        Raises:
            UnreachableError: It is too far out or too close in; the message states by how much.
                Or its yaw is in degrees.
            InvalidArgumentError: It is not a :class:`Pose` of finite numbers.
        """
        pose = require_pose("the pose", pose)
        if abs(pose.yaw) > self._most_yaw:
            raise UnreachableError(
                f"{pose} cannot be reached: no joints turn so far; {unit_hint(pose.yaw, 'rad')}"
            )
        x, y, z, yaw = pose if self._plain_base else self._to_base.compose(pose)
        tx, ty, tz, tyaw = self.tool
        turn = yaw - tyaw
        c, s = math.cos(turn), math.sin(turn)
        x, y = x - c * tx + s * ty, y - s * tx - c * ty
        l1, l2 = self._l1, self._l2
        cosine = (x * x + y * y - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
        if not -1.0 <= cosine <= 1.0:
            cosine = self._stretch(pose, x, y, cosine)
        q3, sine = math.acos(cosine), math.sqrt((1.0 - cosine) * (1.0 + cosine))
        bearing, inside = math.atan2(y, x), math.atan2(l2 * sine, l1 + l2 * cosine)
        q2 = z - tz - self._height
        first, second = self._wrap(0, bearing - inside), self._wrap(0, bearing + inside)
        elbows = (self._wrap(2, q3), self._wrap(2, -q3)) if self._elbow_turns else (q3, -q3)
        return (
            Joints(first, q2, elbows[0], self._wrap(3, turn - first - q3)),
            Joints(second, q2, elbows[1], self._wrap(3, turn - second + q3)),
        )

    def solve(self, pose: Pose, near: Sequence[float]) -> Joints:
        """Return the solution for a pose that is within limits and closest to ``near``.

        A joint with a range of more than one full turn takes the turn closest to ``near``.

        Args:
            pose: Of the tool.
            near: Joints from which the arm comes [rad, m, rad, rad].

        Raises:
            UnreachableError: No solution is within the limits; the message states for each which
                joint is beyond its limit, and by how much.
            InvalidArgumentError: ``near`` is not finite, or ``pose`` is not a :class:`Pose`.
        """
        near = numbers("the joints to start from", near, "give one for each joint")
        if len(near) != len(self.limits):
            raise InvalidArgumentError(
                f"{len(near)} joints to start from; the arm has {len(self.limits)}"
            )
        pose = require_pose("the pose", pose)
        both = self.inverse(pose)
        good = [self._unwound(joints, near) for joints in both if not self.beyond(joints)]
        if not good:
            # If the lift alone is beyond its limits for both elbows, it is reported once.
            reasons = dict.fromkeys(", ".join(self.beyond(joints)) for joints in both)
            raise UnreachableError(
                f"{pose} cannot be reached: it would take {' or '.join(reasons)}"
            )
        return min(good, key=lambda joints: _distance(joints, near))

    def beyond(self, joints: Sequence[float]) -> list[str]:
        """Return a sentence for each joint that is outside its limits, or not finite."""
        sentences = []
        for limit, value in zip(self.limits, joints, strict=True):
            if not math.isfinite(value):
                sentences.append(f"{limit.name} at {value}, which is not a finite number")
                continue
            if limit.lower - LIMIT_ROUNDING <= value <= limit.upper + LIMIT_ROUNDING:
                continue
            over = value - limit.upper if value > limit.upper else limit.lower - value
            hint = unit_hint(value, limit.unit)
            sentences.append(
                f"{limit.name} at {value:.4f} {limit.unit}, {_amount(over)} {limit.unit} beyond "
                f"its range {limit.lower:g} .. {limit.upper:g} {limit.unit}{hint and f' ({hint})'}"
            )
        return sentences

    def jacobian(self, joints: Sequence[float]) -> tuple[tuple[float, ...], ...]:
        """Return the derivative of the pose by the joints: rows x, y, z, yaw; columns j1 to j4."""
        x1, x3, x4, y1, y3, y4 = self._levers(joints)
        return ((x1, 0.0, x3, x4), (y1, 0.0, y3, y4), (0.0, 1.0, 0.0, 0.0), (1.0, 0.0, 1.0, 1.0))

    def _levers(self, joints: Sequence[float]) -> tuple[float, float, float, float, float, float]:
        """Return the derivatives of x by j1, j3 and j4, then those of y [m/rad]."""
        q1, _, q3, q4 = joints
        q13 = q1 + q3
        yaw = q13 + q4 + self.base.yaw
        q1, q13 = q1 + self.base.yaw, q13 + self.base.yaw
        tx, ty, _, _ = self.tool
        c, s = math.cos(yaw), math.sin(yaw)
        x4, y4 = -s * tx - c * ty, c * tx - s * ty
        x3, y3 = x4 - self._l2 * math.sin(q13), y4 + self._l2 * math.cos(q13)
        x1, y1 = x3 - self._l1 * math.sin(q1), y3 + self._l1 * math.cos(q1)
        return x1, x3, x4, y1, y3, y4

    def rates(self, joints: Sequence[float], velocity: Sequence[float]) -> Joints:
        """Return the joint velocities for a velocity of the tool.

        Args:
            joints: Positions of the joints [rad, m, rad, rad].
            velocity: Of the tool: x, y, z [m/s] and yaw [rad/s].

        Raises:
            UnreachableError: The arm is stretched or folded and cannot move in this direction.
        """
        (x1, _, x3, x4), (y1, _, y3, y4), _, _ = self.jacobian(joints)
        vx, vy, vz, w = velocity
        # Velocity of the wrist's axis, which only j1 and j3 move.
        wx, wy = vx - w * x4, vy - w * y4
        a, b, c, d = x1 - x4, x3 - x4, y1 - y4, y3 - y4
        determinant = a * d - b * c
        if abs(determinant) < _SINGULAR * self._l1 * self._l2:
            off = abs(math.remainder(joints[2], math.pi))
            raise UnreachableError(
                f"j3 is at {joints[2]:.4f} rad, {off:.1e} rad from stretched "
                "or folded: there the arm cannot move so; go through it with a joint motion"
            )
        r1 = (wx * d - b * wy) / determinant
        r3 = (a * wy - wx * c) / determinant
        return Joints(r1, vz, r3, w - r1 - r3)

    def tool_speed(self, joints: Sequence[float], rates: Sequence[float]) -> float:
        """Return the speed of the tool's point, or a bound of that of the load's fastest [m/s].

        Args:
            joints: Positions of the joints [rad, m, rad, rad].
            rates: Velocities of the joints [rad/s, m/s, rad/s, rad/s].
        """
        x1, x3, x4, y1, y3, y4 = self._levers(joints)
        r1, r2, r3, r4 = rates
        vx, vy = x1 * r1 + x3 * r3 + x4 * r4, y1 * r1 + y3 * r3 + y4 * r4
        return self.speed_at((vx, vy, r2, r1 + r3 + r4))

    def speed_at(self, velocity: Sequence[float]) -> float:
        """Return the same speed [m/s] for a velocity of the tool.

        Args:
            velocity: Of the tool: x, y, z [m/s] and yaw [rad/s].
        """
        vx, vy, vz, w = velocity
        if not self.overhang:
            return math.sqrt(vx * vx + vy * vy + vz * vz)
        # A point turns about the tool's point, which itself moves, at worst in the same direction.
        level = math.sqrt(vx * vx + vy * vy) + self.overhang * abs(w)
        return math.sqrt(level * level + vz * vz)

    def _unwound(self, joints: Joints, near: Sequence[float]) -> Joints:
        """Return the same solution with each rotary joint on its turn closest to ``near``."""
        turned = [self._closest(i, joints[i], near[i]) for i in _TURNING]
        return Joints(turned[0], joints.j2, turned[1], turned[2])

    def _closest(self, joint: int, angle: float, near: float) -> float:
        lower, upper = self._bounds[joint]
        least, most = math.ceil((lower - angle) / TURN), math.floor((upper - angle) / TURN)
        if least > most:
            return angle  # beyond its limits by rounding only
        return angle + TURN * min(max(round((near - angle) / TURN), least), most)

    def _wrap(self, joint: int, angle: float) -> float:
        angle = wrapped(angle)
        lower, upper = self._bounds[joint]
        if angle < lower:
            other = angle + TURN * math.ceil((lower - angle) / TURN)
        elif angle > upper:
            other = angle - TURN * math.ceil((angle - upper) / TURN)
        else:
            return angle
        return other if lower <= other <= upper else angle

    def _stretch(self, pose: Pose, x: float, y: float, cosine: float) -> float:
        """Return the cosine bounded to 1 where it exceeds that by rounding only.

        Raises:
            UnreachableError: It exceeds 1 by more.
        """
        if abs(cosine) <= 1.0 + STRETCH_ROUNDING:
            return math.copysign(1.0, cosine)
        distance = math.hypot(x, y)
        reach, least = self._l1 + self._l2, abs(self._l1 - self._l2)
        hint = unit_hint(max(map(abs, pose[:3])), "m")
        ending = f"; {hint}" if hint else ""
        if distance > reach:
            text = f"{_amount(distance - reach)} m beyond the reach of {reach:.4f} m"
        else:
            text = f"{_amount(least - distance)} m inside the least distance of {least:.4f} m"
        raise UnreachableError(
            f"{pose} cannot be reached: the wrist would be {text} from the column{ending}"
        )


def _amount(value: float) -> str:
    """Format an excess with 4 decimals, a small one with two significant digits."""
    return f"{value:.4f}" if value >= _SMALL else f"{value:.2g}"


def _distance(joints: Sequence[float], near: Sequence[float]) -> float:
    return max(abs(a - b) for a, b in zip(joints, near, strict=True))
