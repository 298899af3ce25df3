"""How values of tasks are written in files and by the page: with names where a list has none."""

from __future__ import annotations

from typing import Annotated, Self

import msgspec

from bioscara.arguments import numbers, text
from bioscara.errors import InvalidArgumentError, LimitError
from bioscara.kinematics import Joints, Pose
from bioscara.kinematics.pose import ANGLE_MAX, PLACE_MAX
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.limits import LEAST
from bioscara.robot.tasks.checks import check_fields, checked_by, within
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.tools import MASS_MAX, OFFSET_MAX

_DIGITS = 9
"""Decimal places of a corner that is computed from the centre [m]: a nanometre."""

Angle = Annotated[float, within(-ANGLE_MAX, ANGLE_MAX, "rad", "are these degrees?")]
Length = Annotated[float, within(-PLACE_MAX, PLACE_MAX, "m", "are these millimetres?")]
_Name = Annotated[str, checked_by(text)]


def _corner(name: str, value: object) -> tuple[float, ...]:
    corner = numbers(name, value, "give [x, y, z]")
    if len(corner) != 3:
        raise InvalidArgumentError(f"{name} has {len(corner)} numbers; give [x, y, z]")
    for given in corner:
        if not -OFFSET_MAX <= given <= OFFSET_MAX:
            remedy = "are these millimetres?"
            raise LimitError(name, given, -OFFSET_MAX, OFFSET_MAX, "m", remedy)
    return corner


_Corner = Annotated[
    tuple[float, float, float],
    checked_by(_corner),
]


class Form(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of the forms; its fields are checked as those of a task."""

    def __post_init__(self) -> None:
        check_fields(self)


class PoseForm(Form, frozen=True):
    """A pose of the tool: ``{x, y, z, yaw}``."""

    x: Length
    y: Length
    z: Length
    yaw: Angle = 0.0

    def made(self) -> Pose:
        """Return the pose."""
        return Pose(self.x, self.y, self.z, self.yaw)

    @classmethod
    def of(cls, pose: Pose) -> Self:
        """Return the form of a pose."""
        return cls(*pose)


class JointForm(Form, frozen=True):
    """Positions of the joints: ``{j1, j2, j3, j4}``."""

    j1: Angle
    j2: Length
    j3: Angle
    j4: Angle

    def made(self) -> Joints:
        """Return the positions."""
        return Joints(self.j1, self.j2, self.j3, self.j4)

    @classmethod
    def of(cls, positions: Joints) -> Self:
        """Return the form of positions."""
        return cls(*positions)


class LoadForm(Form, frozen=True, kw_only=True):
    """A load that is a box in the frame of the tool centre point.

    Attributes:
        name: Its name.
        lower: Smallest x, y, z.
        upper: Largest x, y, z.
        yaw: Rotation about its centre.
        mass: Its mass; a record only.
        touches: Zones, or ``"table"``, that it may touch.
        max_speed: Highest commanded speed of its fastest point; null for no own limit.
    """

    name: _Name
    lower: _Corner
    upper: _Corner
    yaw: Angle = 0.0
    mass: Annotated[float, within(0.0, MASS_MAX, "kg")] = 0.0
    touches: tuple[str, ...] = ()
    max_speed: Annotated[float, within(LEAST, 10.0, "m/s")] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for axis, low, high in zip("xyz", self.lower, self.upper, strict=True):
            if not low < high:
                raise InvalidArgumentError(
                    f"upper: its {axis}, {high:g} m, must be above that of lower, {low:g} m"
                )

    def made(self) -> Load:
        """Return the load."""
        shape = Prism.between(self.lower, self.upper, self.yaw)
        return Load(self.name, shape, self.mass, self.touches, self.max_speed)

    @classmethod
    def of(cls, load: Load) -> Self:
        """Return the form of a load."""
        shape = load.shape
        across, along = shape.half_x + shape.radius, shape.half_y + shape.radius
        lower = shape.x - across, shape.y - along, shape.low
        upper = shape.x + across, shape.y + along, shape.high
        return cls(
            name=load.name,
            lower=_rounded(lower),
            upper=_rounded(upper),
            yaw=shape.yaw,
            mass=load.mass,
            touches=load.touches,
            max_speed=load.max_speed,
        )


def _rounded(corner: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (round(value, _DIGITS) for value in corner)
    return x, y, z
