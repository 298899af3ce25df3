"""The bodies around an arm: all are upright boxes in the frame of its base."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple, Self

from bioscara.kinematics import Pose
from bioscara.model.labware import Labware, Mass
from bioscara.model.validation import Checked, Problem, Restricted, Within, not_above
from bioscara.planning.collision.scene import FAR
from bioscara.planning.collision.shapes import Prism

FOOTPRINT = (0.12776, 0.08548)
"""Size of labware in plan view, for which nests are made [m]: ANSI/SLAS 1-2004."""
GUIDE = 3e-3
"""Thickness of a nest's guides [m]: a choice."""
FLOOR = 8e-3
"""Thickness of a nest's floor [m]: a choice."""
TABLE_THICKNESS = 0.02
"""Thickness of a table [m]: a choice."""
_NAME = "[A-Za-z][A-Za-z0-9_/-]{0,59}"
BodyName = Annotated[str, Restricted(pattern=_NAME)]
"""Letters, digits, ``_``, ``-`` and ``/``; begins with a letter."""
Coordinate = Annotated[float, Within(-FAR, FAR, "m")]
Corner = tuple[Coordinate, Coordinate, Coordinate]
Angle = Annotated[float, Within(-2.0 * math.pi, 2.0 * math.pi, "rad")]
Play = Annotated[float, Within(0.0, 0.01, "m")]
Guides = Annotated[float, Within(1e-3, 0.05, "m")]


class Table(Checked):
    """The table on which the arm stands.

    Attributes:
        height: Of its top [m], base frame.
        lower: Smallest x, y of its top [m].
        upper: Largest x, y of its top [m].
    """

    height: Coordinate
    lower: tuple[Coordinate, Coordinate]
    upper: tuple[Coordinate, Coordinate]

    def problems(self) -> Iterator[Problem]:
        """Yield an edge that is not above the opposite one."""
        yield from _unordered(self.lower, self.upper)

    @property
    def shape(self) -> Prism:
        """The table as a shape in the base frame."""
        low = self.height - TABLE_THICKNESS
        return Prism.between((*self.lower, low), (*self.upper, self.height))


class Wall(Checked):
    """A box that nothing moves: a wall, a shelf, an instrument.

    Attributes:
        name: Its name.
        lower: Smallest x, y, z [m], base frame.
        upper: Largest x, y, z [m].
        yaw: Rotation about its centre [rad].
    """

    name: BodyName
    lower: Corner
    upper: Corner
    yaw: Angle = 0.0

    def problems(self) -> Iterator[Problem]:
        """Yield a corner that is not above the opposite one."""
        yield from _unordered(self.lower, self.upper)

    @property
    def shape(self) -> Prism:
        """The wall as a shape in the base frame."""
        return Prism.between(self.lower, self.upper, self.yaw)


class Nest(Checked):
    """A place for labware: a floor with guides at its corners.

    Attributes:
        name: Its name.
        x: Of its centre [m], base frame.
        y: [m].
        z: Height of the floor on which labware stands [m].
        yaw: Direction of the labware's long side [rad].
        play: Distance of the guides from labware on each side [m].
        height: Of the guides above the floor [m].
    """

    name: BodyName
    x: Coordinate
    y: Coordinate
    z: Coordinate
    yaw: Angle = 0.0
    play: Play = 1e-3
    height: Guides = 3e-3

    @property
    def top(self) -> float:
        """Height at which labware stands [m], base frame."""
        return self.z

    @property
    def room(self) -> Prism:
        """The space between the guides, in the base frame."""
        half_x, half_y = (size / 2.0 + self.play for size in FOOTPRINT)
        high = self.z + self.height
        return Prism(self.x, self.y, half_x, half_y, self.z, high, 0.0, self.yaw)

    @property
    def shape(self) -> Prism:
        """Floor and guides as one shape, in the base frame."""
        half_x, half_y = (size / 2.0 + self.play + GUIDE for size in FOOTPRINT)
        low, high = self.z - FLOOR, self.z + self.height
        return Prism(self.x, self.y, half_x, half_y, low, high, 0.0, self.yaw)


class Grip(NamedTuple):
    """Where and how the jaws hold a piece of labware.

    Attributes:
        pose: Pose of the tool centre point between the finger tips, base frame.
        width: Distance of the jaws [m].
    """

    pose: Pose
    width: float


class Item(Checked):
    """A piece of labware.

    Attributes:
        name: Its name.
        labware: Its kind.
        x: Of its centre [m], base frame.
        y: [m].
        z: Height of its bottom [m].
        yaw: Direction of its long side [rad].
        mass: [kg], with its content; that of the empty kind unless given.
        on: Name of the nest or item on which it stands; None on the table or a wall.
    """

    name: BodyName
    labware: Labware
    x: Coordinate
    y: Coordinate
    z: Coordinate
    yaw: Angle = 0.0
    mass: Mass = 0.0  # Never used: unchecked() has that of the kind.
    on: str | None = None

    @classmethod
    def unchecked(cls, **values: Any) -> Self:
        """Return the item of these values; its mass is that of its kind, unless it is given."""
        return super().unchecked(**{"mass": values["labware"].mass, **values})

    @property
    def shape(self) -> Prism:
        """The item as a shape in the base frame."""
        half_x, half_y, _ = (size / 2.0 for size in self.labware.size)
        high = self.z + self.labware.size[2]
        return Prism(self.x, self.y, half_x, half_y, self.z, high, 0.0, self.yaw)

    @property
    def top(self) -> float:
        """Height at which labware on top of it stands [m], base frame."""
        return self.z + self.labware.stack_height

    @property
    def grip(self) -> Grip:
        """Where and how the jaws hold it."""
        pose = Pose(self.x, self.y, self.z + self.labware.grip_height, self.yaw)
        return Grip(pose, self.labware.grip_width)

    @property
    def shape_in_tool(self) -> Prism:
        """The item as a shape in the frame of the tool that holds it, as a ``Load`` has it."""
        half_x, half_y, _ = (size / 2.0 for size in self.labware.size)
        below = self.labware.grip_height
        return Prism(0.0, 0.0, half_x, half_y, -below, self.labware.size[2] - below)


def _unordered(lower: tuple[float, ...], upper: tuple[float, ...]) -> Iterator[Problem]:
    for axis, (low, high) in enumerate(zip(lower, upper, strict=True)):
        yield from not_above(high, low, "upper", axis, others=(("lower", axis),))
