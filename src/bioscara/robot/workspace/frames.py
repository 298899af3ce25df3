"""Work frames: where a bench, a rack or a device stands."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from bioscara.arguments import shown
from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Pose
from bioscara.kinematics.pose import ANGLE_MAX, PLACE_MAX, require_near, wrapped
from bioscara.robot.workspace.tools import check_name, check_number

TILT_MAX = math.radians(0.5)
"""Largest tilt of a taught plane [rad]: 1 mm over a microplate. The arm cannot follow a tilt."""
APART = 0.02
"""Least distance of the taught points [m]: half a millimetre of error is then 1.4 degrees."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A named upright frame in the base; immutable.

    Motions take poses in the base, which :meth:`pose` and :meth:`compose` return.

    Attributes:
        name: Letters, digits, ``_`` and ``-``; begins with a letter.
        pose_frame_in_base: Where its origin is, and how it is rotated about the vertical.

    Raises:
        InvalidArgumentError: The name is not valid, or a value is not finite or too large.
    """

    name: str
    pose_frame_in_base: Pose

    def __post_init__(self) -> None:
        check_name("frame", self.name)
        pose = require_near(f"frame {self.name}", self.pose_frame_in_base)
        object.__setattr__(self, "pose_frame_in_base", pose)

    @classmethod
    def from_points(
        cls, name: str, origin: Pose, on_x: Pose, on_plane: Pose | None = None
    ) -> Frame:
        """Return the frame that was taught by points, each the tool's pose in the base.

        Frames are upright, so two points give all of one; of the second, the height does not
        count. A third one adds no value: it shows a plane that is not level, or points that were
        taken in another order.

        Args:
            name: Of the frame.
            origin: At its origin.
            on_x: On its x axis, at positive x.
            on_plane: At the height of the others and at positive y; None without such a check.

        Raises:
            InvalidArgumentError: Points are less than :data:`APART` apart in plan view, are in one
                line or in another order, or their plane is tilted by more than :data:`TILT_MAX`:
                all poses of the arm are upright.
        """
        check_name("frame", name)
        what = f"frame {name}"
        origin = require_near(f"{what}, origin", origin)
        if on_plane is None:
            on_x = require_near(f"{what}, on_x", on_x)
            ahead, left = on_x.x - origin.x, on_x.y - origin.y
            _require_apart(what, "on_x", math.hypot(ahead, left), "the first point")
            return cls(name, Pose(origin.x, origin.y, origin.z, math.atan2(left, ahead)))
        yaw, _, aside = level(what, origin, {"on_x": on_x, "on_plane": on_plane})
        if aside < 0.0:
            raise InvalidArgumentError(
                f"{what}: on_plane is {-1e3 * aside:.0f} mm to the right of the x axis, where y is "
                "negative; teach a point to its left, as seen from above"
            )
        return cls(name, Pose(origin.x, origin.y, origin.z, yaw))

    def pose(self, x: float, y: float, z: float = 0.0, yaw: float = 0.0) -> Pose:
        """Return the pose in the base of a place in this frame.

        Args:
            x: [m].
            y: [m].
            z: [m].
            yaw: Rotation about the vertical [rad].

        Raises:
            InvalidArgumentError: A value is not finite, or too large to be metres or radians.
        """
        what = f"a pose in frame {self.name}"
        x, y, z = [
            check_number(f"{what}, {axis}", value, PLACE_MAX, "m")
            for axis, value in zip("xyz", (x, y, z), strict=True)
        ]
        turn = check_number(f"{what}, yaw", yaw, ANGLE_MAX, "rad")
        pose = self.pose_frame_in_base.compose(Pose(x, y, z, turn))
        return pose._replace(yaw=wrapped(pose.yaw))

    def compose(self, pose: Pose) -> Pose:
        """Return a pose given in this frame as one in the base; errors as :meth:`pose`."""
        if not isinstance(pose, Pose):
            raise InvalidArgumentError(
                f"the pose in frame {self.name} is {shown(pose)}; give Pose(x, y, z, yaw)"
            )
        return self.pose(pose.x, pose.y, pose.z, pose.yaw)


def level(what: str, origin: Pose, points: Mapping[str, Pose]) -> tuple[float, float, float]:
    """Return the direction from a taught point to the first of two others.

    Args:
        what: Name of the frame or grid in messages.
        origin: The taught point.
        points: The two others, by their names in messages.

    Returns:
        The direction [rad], and how far the second point is along it and to its left [m].

    Raises:
        InvalidArgumentError: Points coincide or are in one line, or their plane is tilted.
    """
    (one, first), (other, second) = (
        (name, require_near(f"{what}, {name}", point)) for name, point in points.items()
    )
    ax, ay, az = first.x - origin.x, first.y - origin.y, first.z - origin.z
    bx, by, bz = second.x - origin.x, second.y - origin.y, second.z - origin.z
    length = math.hypot(ax, ay)
    _require_apart(what, one, length, "the first point")
    aside, along = (ax * by - ay * bx) / length, (ax * bx + ay * by) / length
    _require_apart(what, other, abs(aside), f"the line from the first point to {one}")
    # Normal of the plane.
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    tilt = math.atan2(math.hypot(nx, ny), abs(nz))
    if tilt > TILT_MAX:
        raise InvalidArgumentError(
            f"{what}: its plane is tilted by {math.degrees(tilt):.2f} degrees, which is more than "
            f"{math.degrees(TILT_MAX):g}; level it, as the arm cannot follow a tilt ({one} is "
            f"{1e3 * az:+.1f} mm and {other} {1e3 * bz:+.1f} mm above the first point)"
        )
    return math.atan2(ay, ax), along, aside


def _require_apart(what: str, point: str, distance: float, other: str) -> None:
    if distance < APART:
        raise InvalidArgumentError(
            f"{what}: {point} is {1e3 * distance:.1f} mm from {other} in plan view; teach points "
            f"at least {1e3 * APART:.0f} mm apart"
        )
