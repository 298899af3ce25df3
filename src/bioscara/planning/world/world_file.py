"""World files: YAML of version 2, in which nothing is ignored.

A scene file, version 1, is a world without bodies.

    version: 2
    margin: 0.005                # m
    table: {height: 0.0, lower: [-0.7, -0.7], upper: [0.7, 0.7]}    # null where there is none
    labware_files: []            # own labware, in the folder of this file
    zones: []                    # as in version 1
    walls:
      - {name: back, lower: [-0.7, -0.7, 0.0], upper: [-0.69, 0.7, 0.4]}
    nests:
      - {name: a, x: 0.35, y: 0.25, z: 0.02}
    hotels:
      - {name: hotel, x: 0.0, y: 0.5, z: 0.02, levels: 3, pitch: 0.2}
    stacks:
      - {name: stack, kind: microplate_96, count: 3, place: hotel/1}
    labware:
      - {name: plate, kind: microplate_96, place: a}
      - {name: lid, kind: corning_96_lid, x: 0.3, y: 0.0, z: 0.0, mass: 0.012}

Version, margin and table are required.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, NoReturn, TypeVar

from bioscara.errors import ConfigurationError
from bioscara.model.labware import Labware, Mass, labware_table
from bioscara.model.validation import Checked, Location, Name, Problem, Within
from bioscara.model.yaml_file import YamlFile
from bioscara.planning.collision.scene import Scene
from bioscara.planning.files.scene_file import (
    VERSION as SCENE_VERSION,
    WORLD_VERSION,
    Margin,
    Zones,
    made_zones,
    scene_in,
)
from bioscara.planning.world.bodies import (
    Angle,
    BodyName,
    Coordinate,
    Guides,
    Item,
    Nest,
    Play,
    Table,
    Wall,
)
from bioscara.planning.world.checks import conflicts
from bioscara.planning.world.world import World, too_many
from bioscara.spelling import did_you_mean

LEVELS_MAX = 50
"""Most levels of a hotel, and most pieces of labware of a stack."""
_PLACE = ("x", "y", "z")
_MESHES = ("mesh", "meshes")
Body = TypeVar("Body", Nest, Item)


class Hotel(Checked):
    """Nests above one another: ``NAME/1`` is the lowest.

    Attributes:
        name: Its name.
        x: Of its centre [m], base frame.
        y: [m].
        z: Height of the lowest floor [m].
        yaw: Direction of the labware's long side [rad].
        levels: Number of nests.
        pitch: Height from a floor to the next [m].
        play: Distance of the guides from labware on each side [m].
        height: Of the guides above their floor [m].
    """

    name: BodyName
    x: Coordinate
    y: Coordinate
    z: Coordinate
    yaw: Angle = 0.0
    levels: Annotated[int, Within(1, LEVELS_MAX)]
    pitch: Annotated[float, Within(0.01, 1.0, "m")]
    play: Play = 1e-3
    height: Guides = 3e-3

    def nests(self) -> Iterator[Nest]:
        """Yield the nests, the lowest first."""
        for level in range(self.levels):
            yield Nest(
                name=f"{self.name}/{level + 1}", x=self.x, y=self.y, z=self.z + level * self.pitch,
                yaw=self.yaw, play=self.play, height=self.height,
            )  # fmt: skip


class Piece(Checked):
    """A piece of labware, either on a nest or other labware, or at a place.

    Attributes:
        name: Its name.
        kind: Its kind in the labware table.
        place: Name of the nest or of the labware on which it stands.
        x: Of its centre [m], base frame.
        y: [m].
        z: Height of its bottom [m].
        yaw: Direction of its long side [rad].
        mass: [kg], with its content; that of the empty kind unless given.
    """

    name: BodyName
    kind: Name
    place: Name | None = None
    x: Coordinate | None = None
    y: Coordinate | None = None
    z: Coordinate | None = None
    yaw: Angle | None = None
    mass: Mass | None = None

    @classmethod
    def arranged(cls, values: Mapping[Any, object]) -> Mapping[Any, object]:
        """Refuse meshes in the words of this format."""
        for key in _MESHES:
            if key in values:
                raise ValueError(
                    f"{key}: bodies are boxes, and no meshes are read; give a kind, which may be "
                    "one of a file named in labware_files, or a wall"
                )
        return values

    def problems(self) -> Iterator[Problem]:
        """Yield a place that is missing or given twice."""
        missing = [name for name in _PLACE if getattr(self, name) is None]
        if self.place is None and missing:
            text = "is missing; give x, y and z, or 'place': what it stands on"
            yield Problem(text, (missing[0] if len(missing) < len(_PLACE) else "place",))
        given = [name for name in (*_PLACE, "yaw") if getattr(self, name) is not None]
        if self.place is not None and given:
            yield Problem("follows from 'place'; leave out one of them", (given[0],))

    @property
    def names(self) -> list[str]:
        """Names of the items, the lowest first."""
        return [self.name]

    def items(self, kind: Labware, below: Nest | Item | None) -> Iterator[Item]:
        """Yield the items, the lowest first; ``below`` is what ``place`` names."""
        x, y, z, yaw = self.x or 0.0, self.y or 0.0, self.z or 0.0, self.yaw or 0.0
        if below is not None:
            x, y, z, yaw = below.x, below.y, below.top, below.yaw
        mass = kind.mass if self.mass is None else self.mass
        on = self.place
        for name in self.names:
            yield Item(name=name, labware=kind, x=x, y=y, z=z, yaw=yaw, mass=mass, on=on)
            z, on = z + kind.stack_height, name


class LabwareStack(Piece):
    """Labware of one kind on one another: ``NAME/1`` is the lowest, and stands as a piece does.

    Attributes:
        name: Its name.
        kind: Kind in the labware table.
        count: Number of pieces.
        place: Name of the nest or of the labware on which it stands.
        x: Of its centre [m], base frame.
        y: [m].
        z: Height of its bottom [m].
        yaw: Direction of its long side [rad].
        mass: Of each piece [kg], with its content; that of the empty kind unless given.
    """

    count: Annotated[int, Within(1, LEVELS_MAX)]

    @property
    def names(self) -> list[str]:
        """Names of the items, the lowest first."""
        return [f"{self.name}/{number + 1}" for number in range(self.count)]


class WorldFile(Checked):
    """A world file.

    Attributes:
        version: Of the format: 2.
        margin: Distance that the planner keeps from everything [m].
        table: The table on which the arm stands; null if there is none.
        labware_files: Files with own kinds of labware, relative to the folder of this one.
        zones: Spaces that the planner keeps the arm out of, or in; they have no body.
        walls: Boxes that nothing moves.
        nests: Places for labware.
        hotels: Nests above one another.
        stacks: Labware on one another.
        labware: Pieces of labware.
    """

    version: Annotated[int, Within(1, 10**6)]
    margin: Margin
    table: Table | None
    labware_files: tuple[Name, ...] = ()
    zones: Zones = ()
    walls: tuple[Wall, ...] = ()
    nests: tuple[Nest, ...] = ()
    hotels: tuple[Hotel, ...] = ()
    stacks: tuple[LabwareStack, ...] = ()
    labware: tuple[Piece, ...] = ()

    def problems(self) -> Iterator[Problem]:
        """Yield that there are too many bodies."""
        nests = len(self.nests) + sum(hotel.levels for hotel in self.hotels)
        pieces = len(self.labware) + sum(stack.count for stack in self.stacks)
        if text := too_many(len(self.walls) + nests + pieces):
            yield Problem(text)


def read_world(path: Path | str) -> World:
    """Read a world from a file.

    Args:
        path: The file, of version 2; or a scene file, version 1, which has no bodies.

    Raises:
        ConfigurationError: The file or one that it names cannot be read, a key is unknown or
            missing, a value is invalid, or the bodies cannot be one world; the message names file
            and line.
    """
    path = Path(path)
    file = YamlFile.load(path, str(path))
    if file.at(("version",)) == SCENE_VERSION:
        return World(scene_in(file))
    file.check_version("version", SCENE_VERSION, WORLD_VERSION)
    written = WorldFile.checked(file.values, file.place)
    return _Reading(file, path.parent, written).world()


class _Reading:
    """The bodies of a world file, and the places in the file where they are written."""

    def __init__(self, file: YamlFile, folder: Path, written: WorldFile) -> None:
        self._file, self._folder, self._written = file, folder, written
        self._places: dict[str, Location] = {"table": ("table",)}

    def world(self) -> World:
        """Return the world; errors as :func:`read_world`."""
        written, walls = self._written, [*self._written.walls]
        for index, wall in enumerate(walls):
            self._places.setdefault(wall.name, ("walls", index))
        nests = [*self._nests()]
        items = self._items({nest.name: nest for nest in nests})
        zones = made_zones(written.zones, self._file)
        names = [zone.name for zone in zones]
        for conflict in conflicts(names, written.table, walls, nests, items):
            self._refuse(self._places[conflict.name], conflict.text)
        return World(
            Scene(zones, margin=written.margin), written.table, tuple(walls), tuple(nests),
            tuple(items),
        )  # fmt: skip

    def _nests(self) -> Iterator[Nest]:
        for index, nest in enumerate(self._written.nests):
            self._places.setdefault(nest.name, ("nests", index))
            yield nest
        for index, hotel in enumerate(self._written.hotels):
            place = ("hotels", index)
            for nest in self._made(place, hotel.name, hotel.nests()):
                self._places.setdefault(nest.name, place)
                yield nest

    def _items(self, nests: dict[str, Nest]) -> list[Item]:
        """Return the labware, each piece after the one below it."""
        kinds = self._kinds()
        waiting: dict[Location, Piece] = {}
        for key, pieces in (("stacks", self._written.stacks), ("labware", self._written.labware)):
            waiting |= {(key, index): piece for index, piece in enumerate(pieces)}
        names = {*nests, *(name for piece in waiting.values() for name in piece.names)}
        for at, piece in waiting.items():
            for what, name, known in (("kind", piece.kind, kinds), ("place", piece.place, names)):
                if name is not None and name not in known:
                    thing = "kind of labware" if what == "kind" else "nest or labware"
                    hint = did_you_mean(name, known, f"there are {', '.join(sorted(known))}")
                    text = f"{piece.name}, {what}: there is no {thing} {name!r}; {hint}"
                    self._refuse((*at, what), text)
        there: dict[str, Nest | Item] = {**nests}
        items: list[Item] = []
        while waiting:
            ready = [at for at, each in waiting.items() if each.place in {None, *there}]
            if not ready:
                at, piece = next(iter(waiting.items()))
                text = f"{piece.name} stands on itself, by way of {piece.place}; correct 'place'"
                self._refuse((*at, "place"), text)
            for at in ready:
                piece = waiting.pop(at)
                below = None if piece.place is None else there[piece.place]
                for item in self._made(at, piece.name, piece.items(kinds[piece.kind], below)):
                    self._places.setdefault(item.name, at)
                    there.setdefault(item.name, item)
                    items.append(item)
        return items

    def _kinds(self) -> Mapping[str, Labware]:
        """Return the labware table with the files that the world names."""
        files = [self._folder / name for name in self._written.labware_files]
        for index, path in enumerate(files):
            if not path.is_file():
                self._refuse(
                    ("labware_files", index),
                    f"labware_files: there is no file {path}; correct its name, which is relative "
                    "to the folder of this file",
                )
        return labware_table(*files)

    def _made(self, place: Location, name: str, bodies: Iterator[Body]) -> Iterator[Body]:
        """Yield the bodies of an entry; refuse derived values, as a height in a stack."""
        try:
            yield from bodies
        except ConfigurationError as error:
            self._refuse(place, f"{name}: {error}")

    def _refuse(self, place: Location, text: str) -> NoReturn:
        raise ConfigurationError(f"{self._file.place(place)}{text}") from None
