"""The keys of ``bioscara jog``: velocities while one is held, or steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from bioscara.kinematics import Joints, Pose
from bioscara.model import JointParameters
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity

HOLD = 0.2
"""Time after its last repeat for which a key counts as held [s]: slow consoles repeat after 0.1 s,
and an arm must not go on when a key is released."""
_DIRECTIONS = {
    "w": (0, 1),
    "s": (0, -1),
    "a": (1, 1),
    "d": (1, -1),
    "r": (2, 1),
    "f": (2, -1),
    "t": (3, 1),
    "g": (3, -1),
    "up": (0, 1),
    "down": (0, -1),
    "left": (1, 1),
    "right": (1, -1),
}
_JOINT_OF_AXIS = (0, 2, 1, 3)
"""r and f move the lift, t and g turn the hand, as in the other mode."""
_TOOL_SPEEDS = (0.2, 0.2, 0.2, 1.0)
"""Tool velocity at 100 % [m/s, rad/s]."""
_SHARES = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
_STEPS = (0.1, 0.2, 0.5, 1.0, 5.0, 10.0)
"""Sizes of a step [mm, deg]."""


class JogStep(NamedTuple):
    """A displacement.

    Attributes:
        by: Of the tool in the base, or of the joints.
    """

    by: Pose | Joints


class JogKeys:
    """The state that the keys set, without a terminal or an arm.

    Attributes:
        ended: Whether ``q`` was pressed.
        step: The step that was requested and not taken yet.
    """

    def __init__(self, joints: Sequence[JointParameters]) -> None:
        self._speeds = tuple(joint.max_velocity for joint in joints)
        self._units = tuple(joint.unit for joint in joints)
        self._names = tuple(joint.name for joint in joints)
        self._of_tool, self._steps, self._level = True, False, 2
        self._held, self._until = (0, 0), -math.inf
        self.ended = False
        self.step: JogStep | None = None

    def press(self, key: str, time: float) -> None:
        """Accept a key, pressed or repeated.

        Args:
            key: As :meth:`Keyboard.read` returns it.
            time: Now [s].
        """
        if key == "q":
            self.ended = True
        elif key in {"+", "="}:
            self._level = min(self._level + 1, len(_SHARES) - 1)
        elif key in {"-", "_"}:
            self._level = max(self._level - 1, 0)
        elif key in {"m", "n"}:
            self._until = -math.inf
            self._of_tool ^= key == "m"
            self._steps ^= key == "n"
        elif key in _DIRECTIONS:
            self._held = _DIRECTIONS[key]
            if self._steps:
                self.step = self._requested()
            else:
                self._until = time + HOLD
        else:
            # Any other key ends the motion.
            self._until = -math.inf

    def velocity(self, time: float) -> JointVelocity | ToolVelocity:
        """Return the velocity at a time [s]; zero if no key is held."""
        axis, sign = self._held
        share = sign * _SHARES[self._level] if time < self._until else 0.0
        values = [0.0] * 4
        if self._of_tool:
            values[axis] = share * _TOOL_SPEEDS[axis]
            return ToolVelocity(*values)
        joint = _JOINT_OF_AXIS[axis]
        values[joint] = share * self._speeds[joint]
        return JointVelocity(*values)

    def lines(self) -> list[str]:
        """Return the mode and the keys, for the display."""
        what = "tool" if self._of_tool else "joints"
        axes: tuple[str, ...] = ("x", "y", "z", "yaw")
        if not self._of_tool:
            axes = tuple(self._names[joint] for joint in _JOINT_OF_AXIS)
        how = f"{_SHARES[self._level]:.0%} speed"
        if self._steps:
            how = f"steps {_STEPS[self._level]:g} mm/deg"
        pairs = zip(("w/s", "a/d", "r/f", "t/g"), axes, strict=True)
        return [
            f"{what}, {how}: " + "  ".join(f"{keys} {axis}" for keys, axis in pairs),
            "m tool/joints  n hold/steps  +/- speed, step size  p pause  c continue  q end",
        ]

    def _requested(self) -> JogStep:
        axis, sign = self._held
        index = axis if self._of_tool else _JOINT_OF_AXIS[axis]
        angle = index == 3 if self._of_tool else self._units[index] == "rad"
        size = sign * _STEPS[self._level]
        values = [0.0] * 4
        values[index] = math.radians(size) if angle else 1e-3 * size
        return JogStep(Pose(*values) if self._of_tool else Joints(*values))
