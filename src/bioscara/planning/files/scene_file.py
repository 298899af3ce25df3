"""Scene files: YAML of one version, in which nothing is implied and nothing is ignored.

version: 1
table_height: 0.0     # m, top of the table in the base frame; null where there is none
margin: 0.005         # m
zones:
  - {name: reader, keep: out, shape: box, lower: [0.3, 0.1, 0.0], upper: [0.5, 0.3, 0.2]}
  - {name: cell, keep: in, shape: cylinder, x: 0.0, y: 0.0, radius: 0.8, low: -0.1, high: 0.9}
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bioscara.errors import ConfigurationError
from bioscara.model.section import described
from bioscara.model.yaml_section import YamlSection, read_sections
from bioscara.planning.collision.margins import MARGINS
from bioscara.planning.collision.scene import FAR, Box, Cylinder, Scene, Zone

VERSION = 1
"""Version of the format that is read."""
_ANY = 1e9
"""Bound for numbers in a file; zones check their own ranges."""


def read_scene(path: Path) -> Scene:
    """Read a scene from a file.

    Args:
        path: The file.

    Raises:
        ConfigurationError: The file cannot be read, has another version, a key is unknown or
            missing, or a value is invalid; the message names file and line.
    """
    top = read_sections(path, str(path))
    top.refuse_unknown(("version", "table_height", "margin", "zones"))
    version = top.value("version")
    if version != VERSION or isinstance(version, bool):
        raise top.error(
            f"version: {described(version)} cannot be read; this program reads {VERSION}", "version"
        )
    table = top.value("table_height")
    zones = [] if top.value("zones") == [] else top.sections("zones")
    with_lines = [(_zone(zone), zone) for zone in zones]
    for index, (zone, section) in enumerate(with_lines):
        if zone.name in [other.name for other, _ in with_lines[:index]]:
            raise section.error(f"zone {zone.name} is there twice", "name")
    return Scene(
        tuple(zone for zone, _ in with_lines),
        None if table is None else top.number("table_height", -FAR, FAR, "m"),
        top.number("margin", *MARGINS, "m"),
    )


def _zone(section: YamlSection) -> Zone:
    shape = section.text("shape", ("box", "cylinder"))
    own = ("lower", "upper", "yaw") if shape == "box" else ("x", "y", "radius", "low", "high")
    section.refuse_unknown(("name", "keep", "shape", "links", *own))
    name = section.text("name")
    keep_in = section.text("keep", ("in", "out")) == "in"
    links = _links(section)
    if shape == "box":
        yaw = section.number("yaw", -_ANY, _ANY, "rad") if "yaw" in section.keys() else 0.0  # noqa: SIM118
        lower, upper = _corner(section, "lower"), _corner(section, "upper")
    else:
        x, y, radius, low, high = (section.number(key, -_ANY, _ANY, "m") for key in own)
    try:
        if shape == "box":
            return Box(name, lower, upper, yaw, keep_in, links)
        return Cylinder(name, x, y, radius, low, high, keep_in, links)
    except ConfigurationError as error:
        raise section.error(str(error)) from error


def _links(section: YamlSection) -> tuple[str, ...]:
    if "links" not in section.keys():  # noqa: SIM118
        return ()
    links = section.value("links")
    if not isinstance(links, list) or not links:
        raise section.error(
            f"{section.name('links')}: {described(links)} is not a list of links", "links"
        )
    return tuple(str(link) for link in links)


def _corner(section: YamlSection, key: str) -> tuple[float, float, float]:
    value: Any = section.value(key)
    fits = isinstance(value, list) and len(value) == 3
    if not fits or not all(isinstance(v, int | float) and not isinstance(v, bool) for v in value):
        raise section.error(
            f"{section.name(key)}: {described(value)} is not [x, y, z] in metres", key
        )
    if any(abs(v) > _ANY for v in value):  # YAML has integers beyond any float
        raise section.error(f"{section.name(key)}: a number is beyond {_ANY:g} m", key)
    x, y, z = (float(v) for v in value)
    return x, y, z
