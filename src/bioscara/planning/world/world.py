"""A world: the bodies around an arm, checked, and the scene that the planner keeps clear of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from bioscara.arguments import items, shown
from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.planning.collision.scene import LOAD, Box, Scene
from bioscara.planning.collision.scene_pairs import LINKS
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.world.bodies import Item, Nest, Table, Wall
from bioscara.planning.world.checks import conflicts
from bioscara.spelling import did_you_mean

BODIES_MAX = 200
"""Most walls, nests and items of a world."""
_BESIDE = tuple(link for link in LINKS if link not in {"jaws", "tool"})
"""Links that keep clear of labware: the jaws hold it, and the tool's point is inside it."""
_OVER_GUIDES = tuple(link for link in LINKS if link not in {LOAD, "tool"})
"""Links that keep clear of the guides of a nest: a load goes between them."""
_INSET = 2.5e-3
"""How far the jaws may be in labware on each side when they hold it [m]: they press, and may be
turned a little. Deeper, and everywhere else, they keep the margin from it."""


@dataclass(frozen=True, slots=True)
class World:
    """The bodies around an arm; immutable.

    Attributes:
        scene: Zones, which have no body, and the margin.
        table: The table; None if there is none.
        walls: Boxes that nothing moves.
        nests: Places for labware.
        items: Labware.
        planned: The scene for the planner, with a zone of its name for each wall, nest and item. A
            load may touch it if that name is among its ``touches``. The jaws keep out of the inner
            part of labware alone, the zone ``NAME/core``, so that they can hold it; a load keeps
            out of the floor of a nest and not of its guides, the zone ``NAME/guides``.

    Raises:
        ConfigurationError: Two have the same name or are in one place, labware stands on nothing,
            a body is in the arm, or there are too many; the message names them.
    """

    scene: Scene = field(default_factory=Scene)
    table: Table | None = None
    walls: tuple[Wall, ...] = ()
    nests: tuple[Nest, ...] = ()
    items: tuple[Item, ...] = ()
    planned: Scene = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.scene, Scene):
            raise ConfigurationError(f"the scene of a world is {shown(self.scene)}, which is none")
        if not isinstance(self.table, Table | None):
            raise ConfigurationError(f"the table of a world is {shown(self.table)}, which is none")
        for name, kind in (("walls", Wall), ("nests", Nest), ("items", Item)):
            given = items(f"the {name} of a world", getattr(self, name), error=ConfigurationError)
            for each in given:
                if not isinstance(each, kind):
                    raise ConfigurationError(
                        f"{shown(each)} is none of the {name} of a world; give {kind.__name__}(...)"
                    )
            object.__setattr__(self, name, given)
        if text := too_many(len(self.walls) + len(self.nests) + len(self.items)):
            raise ConfigurationError(text)
        zones = [zone.name for zone in self.scene.zones]
        for conflict in conflicts(zones, self.table, self.walls, self.nests, self.items):
            raise ConfigurationError(conflict.text)
        height = self.scene.table_height if self.table is None else self.table.height
        planned = replace(
            self.scene, zones=(*self.scene.zones, *self._zones()), table_height=height
        )
        object.__setattr__(self, "planned", planned)

    @property
    def has_bodies(self) -> bool:
        """Whether there is more than zones: a scene file has no bodies."""
        return bool(self.table or self.walls or self.nests or self.items)

    def item(self, name: str) -> Item:
        """Return a piece of labware.

        Raises:
            InvalidArgumentError: There is none of that name.
        """
        for item in self.items:
            if item.name == name:
                return item
        names = [item.name for item in self.items]
        hint = did_you_mean(name, names, f"there is {', '.join(names) or 'none'}")
        raise InvalidArgumentError(f"there is no labware {shown(name)} in the world; {hint}")

    def without(self, name: str) -> World:
        """Return the world without a piece of labware, as when the arm carries it.

        Raises:
            InvalidArgumentError: There is none of that name, or something stands on it.
        """
        taken = self.item(name)
        left = tuple(item for item in self.items if item is not taken)
        try:
            return replace(self, items=left)
        except ConfigurationError as error:
            raise InvalidArgumentError(f"{name} cannot be taken away: {error}") from error

    def placed(self, name: str, on: str) -> World:
        """Return the world with a piece of labware on a nest, or on other labware.

        Args:
            name: Of the labware.
            on: Name of the nest or of the labware below it.

        Raises:
            InvalidArgumentError: There is none of these names, or no room for it.
        """
        moved = self.item(name)
        left = tuple(item for item in self.items if item is not moved)
        bodies: list[Nest | Item] = [*self.nests, *left]
        places = {each.name: each for each in bodies}
        if on not in places:
            hint = did_you_mean(on, places, f"there are {', '.join(places) or 'none'}")
            raise InvalidArgumentError(f"there is no nest or labware {shown(on)}; {hint}")
        below = places[on]
        there = Item(
            name=name, labware=moved.labware, x=below.x, y=below.y, z=below.top, yaw=below.yaw,
            mass=moved.mass, on=on,
        )  # fmt: skip
        try:
            return replace(self, items=(*left, there))
        except ConfigurationError as error:
            raise InvalidArgumentError(f"{name} cannot be placed on {on}: {error}") from error

    def _zones(self) -> Iterator[Box]:
        for wall in self.walls:
            yield Box(wall.name, wall.lower, wall.upper, wall.yaw)
        for nest in self.nests:
            shape = nest.shape
            yield _box(nest.name, shape, shape.low, nest.z)
            yield _box(f"{nest.name}/guides", shape, nest.z, shape.high, _OVER_GUIDES)
        for item in self.items:
            shape = item.shape
            yield _box(item.name, shape, item.z, item.top, _BESIDE)
            half_y = item.labware.grip_width / 2.0 - self.scene.margin - _INSET
            if half_y > 0.0:
                core = replace(shape, half_y=half_y)
                yield _box(f"{item.name}/core", core, shape.low, shape.high, ("jaws",))


def too_many(bodies: int) -> str:
    """Return why a world cannot have so many bodies; nothing if it can."""
    if bodies <= BODIES_MAX:
        return ""
    return f"{bodies} walls, nests and pieces of labware; a world has at most {BODIES_MAX}"


def _box(name: str, shape: Prism, low: float, high: float, links: tuple[str, ...] = ()) -> Box:
    lower = (shape.x - shape.half_x, shape.y - shape.half_y, low)
    upper = (shape.x + shape.half_x, shape.y + shape.half_y, high)
    return Box(name, lower, upper, shape.yaw, False, links)
