"""Meshes of the arm's drawing as binary STL, its masses and inertias as YAML.

The numbers are rounded to a micrometre and to six digits, so that every machine writes the same
bytes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from bioscara.model import GeometryParameters
from bioscara.model.parts import Link, Part, drawing
from bioscara.model.solids import AXES, Array, Solid
from bioscara.model.stl import HEADER, TRIANGLE

FINISHES = ("printed", "metal")
"""Every link is drawn as two meshes: its printed parts, and its metal and rubber ones."""
WALL = 0.004
"""Wall of a printed part: perimeters and infill together, spread over the surface [m]."""


def files(geometry: GeometryParameters) -> dict[str, bytes]:
    """Return every file generated from the drawing, by its path in the description."""
    links = drawing(geometry)
    out = {"links.yaml": _properties(links).encode()}
    for link in links:
        for finish in FINISHES:
            out[f"meshes/{_seen(link, finish)}"] = stl(
                tuple(part.solid for part in _finished(link, finish))
            )
        for name, part in _named(link):
            out[f"meshes/collision/{link.name}_{name}.stl"] = stl((part.solid,))
    return out


def _finished(link: Link, finish: str) -> tuple[Part, ...]:
    """Return the parts of a link with one of the :data:`FINISHES`."""
    return tuple(part for part in link.parts if part.printed is (finish == FINISHES[0]))


def _seen(link: Link, finish: str) -> str:
    """Return the file in ``meshes/`` that draws a finish; of a single part, its collision mesh."""
    drawn, *others = _finished(link, finish)
    for name, part in _named(link):
        if part is drawn and not others:
            return f"collision/{link.name}_{name}.stl"
    return f"visual/{link.name}_{finish}.stl"


def _named(link: Link) -> Iterator[tuple[str, Part]]:
    """Yield the parts of a link with a name for each."""
    for name, parts in link.bodies.items():
        for number, part in enumerate(parts, 1):
            yield (name if len(parts) == 1 else f"{name}_{number}"), part


def _properties(links: tuple[Link, ...]) -> str:
    lines = [
        "# Generated from the drawing (bioscara.model.parts): the meshes of each link,",
        "# and estimates of its mass: printed parts are shells of PLA, motors and rods are solid.",
        "# kg, m and kg m^2; inertias about the centre of mass.",
    ]
    for link in links:
        lines += _lines(link.name, weigh(moments(part) for part in link.parts))
        lines += [f"  {finish}: {_seen(link, finish)}" for finish in FINISHES]
        lines.append(f"  collision: [{', '.join(name for name, _ in _named(link))}]")
    return "\n".join([*lines, ""])


def _lines(name: str, inertial: Inertial) -> list[str]:
    # Further decimals are rounding errors, which differ between machines.
    centre = ", ".join(f"{number:.6f}" for number in inertial.centre.round(6) + 0.0)
    inertia = inertial.inertia.round(9) + 0.0
    return [
        f"{name}:",
        f"  mass: {inertial.mass:.6f}",
        f"  centre: [{centre}]",
        *(f"  i{'xyz'[i]}{'xyz'[k]}: {inertia[i, k]:.9f}" for i in range(3) for k in range(i, 3)),
    ]


def stl(solids: tuple[Solid, ...]) -> bytes:
    """Return solids as one binary STL file."""
    exact = np.concatenate([triangles(solid) for solid in solids])
    normals = doubled_areas(exact)
    records = np.zeros(len(exact), TRIANGLE)
    records["normal"] = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).round(5) + 0.0
    records["corners"] = exact.round(6) + 0.0
    return bytes(HEADER) + len(records).to_bytes(4, "little") + records.tobytes()


def triangles(solid: Solid) -> Array:
    """Return the surface of a solid, shape (n, 3 corners, 3): counter-clockwise from outside."""
    corners = solid.outline
    count = len(corners)
    points = np.zeros((2, count, 3))
    first, second, along = AXES[solid.axis]
    points[:, :, first], points[:, :, second] = corners[:, 0], corners[:, 1]
    points[0, :, along], points[1, :, along] = solid.lower, solid.upper
    (bottom, top), after = points, np.roll(np.arange(count), -1)
    fan, rest = np.arange(1, count - 1), np.arange(2, count)
    start = np.zeros_like(fan)
    faces = (
        np.stack((bottom[start], bottom[rest], bottom[fan]), axis=1),
        np.stack((top[start], top[fan], top[rest]), axis=1),
        np.stack((bottom, bottom[after], top[after]), axis=1),
        np.stack((bottom, top[after], top), axis=1),
    )
    return np.concatenate(faces)


def doubled_areas(mesh: Array) -> Array:
    """Return the outward normal of each triangle, twice as long as its area, shape (n, 3)."""
    first, second, third = np.moveaxis(mesh, 1, 0)
    return np.cross(second - first, third - first)


class Inertial(NamedTuple):
    """Mass, centre and inertia of a body.

    Attributes:
        mass: Mass [kg].
        centre: Centre of mass in the link's frame [m], shape (3,).
        inertia: Inertia about the centre, along the link's axes [kg m^2], shape (3, 3).
    """

    mass: float
    centre: Array
    inertia: Array


class Moments(NamedTuple):
    """Integrals over a body; those of several bodies add up.

    Attributes:
        mass: Mass [kg].
        first: Integral of position [kg m], shape (3,).
        second: Integral of position times position [kg m^2], shape (3, 3).
    """

    mass: float
    first: Array
    second: Array


def filled(solid: Solid, density: float) -> Moments:
    """Return the integrals over a solid body of a density [kg/m^3]."""
    volumes = np.linalg.det(triangles(solid)) / 6.0
    return _moments(solid, density * volumes, corners=4)


def shell(solid: Solid, density: float, wall: float) -> Moments:
    """Return the integrals over a body with a thin wall [m]; a body too thin for it is filled."""
    areas = np.linalg.norm(doubled_areas(triangles(solid)), axis=1) / 2.0
    whole = filled(solid, density)
    if density * wall * float(areas.sum()) >= whole.mass:
        return whole
    return _moments(solid, density * wall * areas, corners=3)


def _moments(solid: Solid, masses: Array, corners: int) -> Moments:
    """Return the integrals over triangles (3 corners), or the tetrahedra to the origin (4)."""
    points = triangles(solid)
    sums = points.sum(axis=1)
    squares = np.einsum("nci,ncj->nij", points, points) + np.einsum("ni,nj->nij", sums, sums)
    return Moments(
        float(masses.sum()),
        masses @ sums / corners,
        np.einsum("n,nij->ij", masses, squares) / (corners * (corners + 1)),
    )


def weigh(bodies: Iterable[Moments]) -> Inertial:
    """Return mass, centre and inertia of several bodies combined."""
    masses, firsts, seconds = zip(*bodies, strict=True)
    mass = float(sum(masses))
    centre = sum(firsts, np.zeros(3)) / mass
    second = sum(seconds, np.zeros((3, 3))) - mass * np.outer(centre, centre)
    return Inertial(mass, centre, np.trace(second) * np.eye(3) - second)


def moments(part: Part) -> Moments:
    """Return mass and moments of a part; a printed one is a shell."""
    if part.printed:
        return shell(part.solid, part.density, WALL)
    return filled(part.solid, part.density)
