"""Scene files: YAML of one version, in which nothing is implied and nothing is ignored.

version: 1
table_height: 0.0     # m, top of the table in the base frame; null where there is none
margin: 0.005         # m
zones:
  - {name: reader, keep: out, shape: box, lower: [0.3, 0.1, 0.0], upper: [0.5, 0.3, 0.2]}
  - {name: cell, keep: in, shape: cylinder, x: 0.0, y: 0.0, radius: 0.8, low: -0.1, high: 0.9}
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Literal

from bioscara.errors import ConfigurationError
from bioscara.files.whole_files import replacing
from bioscara.model.validation import Before, Checked, Name, Problem, Within
from bioscara.model.yaml_file import YamlFile
from bioscara.planning.collision.arm_bodies import GRIPPER
from bioscara.planning.collision.margins import MARGINS
from bioscara.planning.collision.scene import FAR, Box, Cylinder, Scene

VERSION = 1
"""Version of the format that is read."""
WORLD_VERSION = 2
"""Version of the format of worlds, which have bodies as well."""
_Corner = tuple[float, float, float]


class _Zone(Checked):
    """A zone in the file; zones check their own ranges.

    Attributes:
        name: Its name.
        shape: Its shape.
        keep: Whether the arm keeps in or out of it.
        links: Names of the links that it applies to; all that move unless given.
    """

    name: Name
    keep: Literal["in", "out"]
    links: tuple[str, ...] = ()


class _Box(_Zone):
    """An upright box.

    Attributes:
        lower: Smallest x, y, z [m], base frame.
        upper: Largest x, y, z [m].
        yaw: Rotation about its centre [rad].
    """

    shape: Literal["box"]
    lower: _Corner
    upper: _Corner
    yaw: float = 0.0

    def made(self) -> Box:
        return Box(self.name, self.lower, self.upper, self.yaw, self.keep == "in", self.links)


class _Cylinder(_Zone):
    """An upright cylinder.

    Attributes:
        x: Of its axis [m], base frame.
        y: [m].
        radius: [m].
        low: Height of its bottom [m].
        high: Height of its top [m].
    """

    shape: Literal["cylinder"]
    x: float
    y: float
    radius: float
    low: float
    high: float

    def made(self) -> Cylinder:
        size = self.x, self.y, self.radius, self.low, self.high
        return Cylinder(self.name, *size, self.keep == "in", self.links)


class _Shape(Checked):
    shape: Literal["box", "cylinder"]


def _zone(values: object) -> _Box | _Cylinder:
    """Return the zone by its shape."""
    shape = values
    if isinstance(values, Mapping):
        shape = {key: value for key, value in values.items() if key == "shape"}
    if _Shape.parsed(shape).shape == "box":
        return _Box.parsed(values)
    return _Cylinder.parsed(values)


Zones = tuple[Annotated[_Box | _Cylinder, Before(_zone)], ...]
"""The zones in a file; :func:`made_zones` makes those of a scene from them."""
Margin = Annotated[float, Within(*MARGINS, "m")]


class _Scene(Checked):
    """A scene file."""

    version: Annotated[int, Within(1, 10**6)]
    table_height: Annotated[float, Within(-FAR, FAR, "m")] | None
    margin: Margin
    zones: Zones

    def problems(self) -> Iterator[Problem]:
        """Yield names that are there twice."""
        names = [zone.name for zone in self.zones]
        for index, name in enumerate(names):
            if name in names[:index]:
                yield Problem(f"{name} is there twice", ("zones", index, "name"))


def read_scene(path: Path | str) -> Scene:
    """Read a scene from a file.

    Args:
        path: The file.

    Raises:
        ConfigurationError: The file cannot be read, has another version, a key is unknown or
            missing, or a value is invalid; the message names file and line.
    """
    file = YamlFile.load(Path(path), str(path))
    if file.at(("version",)) == WORLD_VERSION:
        raise ConfigurationError(
            f"{file.place(('version',))}version {WORLD_VERSION} is a world with bodies, not a "
            "scene; give it as --world FILE, or read_world(FILE)"
        )
    return scene_in(file)


def scene_in(file: YamlFile) -> Scene:
    """Return the scene in a file that was read; errors as :func:`read_scene`."""
    file.check_version("version", VERSION)
    scene = _Scene.checked(file.values, file.place)
    return Scene(made_zones(scene.zones, file), scene.table_height, scene.margin)


def made_zones(zones: Zones, file: YamlFile) -> tuple[Box | Cylinder, ...]:
    """Return the zones of a file.

    Raises:
        ConfigurationError: One is not possible; the message names file and line.
    """
    made = []
    for index, zone in enumerate(zones):
        try:
            made.append(zone.made())
        except ConfigurationError as error:
            raise ConfigurationError(f"{file.place(('zones', index))}{error}") from error
    return tuple(made)


def save_scene(path: Path, scene: Scene) -> None:
    """Write a scene to a file atomically: it then holds the whole scene or its former content.

    Args:
        path: The file; if it is a link, its target is written.
        scene: The scene; the widths of the gripper are not written.

    Raises:
        ConfigurationError: The file cannot be written, or the scene has bodies that the wrist
            carries, which the format does not have.
    """
    if scene.mounted != GRIPPER:
        raise ConfigurationError(
            f"{path}: a scene file has no bodies that the wrist carries, as this scene has; use "
            "another file, or a Load"
        )
    try:
        with replacing(path) as partial:
            partial.write_text(_text(scene), encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(
            f"{path}: the scene cannot be saved ({error.strerror or error}); name another file"
        ) from error


def _text(scene: Scene) -> str:
    # JSON is YAML, in which a name or a number needs no other rule.
    zones = [f"  - {json.dumps(_values(zone), ensure_ascii=False)}" for zone in scene.zones]
    lines = [
        f"version: {VERSION}",
        f"table_height: {json.dumps(scene.table_height)}",
        f"margin: {json.dumps(scene.margin)}",
        *(["zones:", *zones] if zones else ["zones: []"]),
    ]
    return "\n".join([*lines, ""])


def _values(zone: Box | Cylinder) -> dict[str, object]:
    kept = {"name": zone.name, "keep": "in" if zone.keep_in else "out"}
    if isinstance(zone, Box):
        shape = {"shape": "box", "lower": zone.lower, "upper": zone.upper, "yaw": zone.yaw}
    else:
        sizes = ("x", "y", "radius", "low", "high")
        shape = {"shape": "cylinder", **{name: getattr(zone, name) for name in sizes}}
    return {**kept, **shape, **({"links": zone.links} if zone.links else {})}
