"""An object that the arm carries."""

from __future__ import annotations

from dataclasses import dataclass, replace

from bioscara.arguments import items, number, shown, text
from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Pose
from bioscara.kinematics.pose import ANGLE_MAX
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.limits import LEAST
from bioscara.robot.workspace.tools import MASS_MAX, OFFSET_MAX, check_name, check_number

REACH_MAX = 0.5
"""Largest horizontal distance of a load's corner from the tool centre point [m]."""


@dataclass(frozen=True, slots=True)
class Load:
    """An object that the arm carries once it is attached; immutable.

    Attributes:
        name: Letters, digits, ``_`` and ``-``; begins with a letter.
        shape: Its shape in the frame of the tool centre point: x away from the wrist, the jaws
            close along y, z upwards.
        mass: [kg]; a record only, no motion depends on it.
        touches: Names of the zones, or ``"table"``, that it is taken from or set down on. Only the
            load may touch these.
        max_speed: Highest commanded speed of its fastest point [m/s], as of an open vessel;
            None for no limit of its own. The limit of the reduced speed applies in any case.

    Raises:
        InvalidArgumentError: A value is not finite or not possible.
    """

    name: str
    shape: Prism
    mass: float = 0.0
    touches: tuple[str, ...] = ()
    max_speed: float | None = None

    def __post_init__(self) -> None:
        check_name("load", self.name)
        what = f"load {self.name}"
        object.__setattr__(self, "shape", _checked(what, self.shape))
        mass = check_number(f"{what}, mass", self.mass, MASS_MAX, "kg")
        if mass < 0.0:
            raise InvalidArgumentError(f"{what}, mass: {mass:g} kg is below zero")
        names = items(f"{what}: the zones that it touches", self.touches, 'give ["table"]')
        touches = tuple(text(f"{what}: a zone that it touches", name) for name in names)
        fastest = None if self.max_speed is None else number(f"{what}, max_speed", self.max_speed)
        if fastest is not None and fastest < LEAST:
            raise InvalidArgumentError(
                f"{what}, max_speed: {fastest:g} m/s is below {LEAST:g} m/s; disable() holds still"
            )
        if (reach := self.shape.reach(0.0, 0.0)) > REACH_MAX:
            raise InvalidArgumentError(
                f"{what}: its farthest corner is {reach:.3f} m from the tool centre point in plan "
                f"view, which is more than {REACH_MAX:g} m; are these millimetres?"
            )
        for field, value in (("mass", mass), ("touches", touches), ("max_speed", fastest)):
            object.__setattr__(self, field, value)

    @property
    def width(self) -> float:
        """Size along y, between the jaws [m]."""
        ys = [y for _, y in self.shape.corners()]
        return max(ys) - min(ys) + 2.0 * self.shape.radius

    def shape_in_wrist(self, tool: Pose) -> Prism:
        """Return the shape in the frame of the wrist, as scenes have it.

        Args:
            tool: Pose of the tool in the wrist.
        """
        shape = self.shape
        there = tool.compose(Pose(shape.x, shape.y, 0.0, shape.yaw))
        low, high = shape.low + tool.z, shape.high + tool.z
        return replace(shape, x=there.x, y=there.y, low=low, high=high, yaw=there.yaw)


def _checked(what: str, shape: object) -> Prism:
    """Return a shape whose values are finite floats and sizes of an object."""
    if not isinstance(shape, Prism):
        raise InvalidArgumentError(
            f"{what}: the shape is {shown(shape)}; give Prism.between(lower, upper)"
        )
    values = {}
    for name in ("x", "y", "half_x", "half_y", "low", "high", "radius"):
        values[name] = check_number(f"{what}, {name}", getattr(shape, name), OFFSET_MAX, "m")
        if name in {"half_x", "half_y", "radius"} and values[name] < 0.0:
            raise InvalidArgumentError(f"{what}, {name}: {values[name]:g} m is below zero")
    values["yaw"] = check_number(f"{what}, yaw", shape.yaw, ANGLE_MAX, "rad")
    if not values["low"] < values["high"]:
        raise InvalidArgumentError(
            f"{what}: its bottom at {values['low']:g} m is not below its top at "
            f"{values['high']:g} m"
        )
    return Prism(**values)
