"""Export of the arm's drawing: meshes as binary STL, masses and inertias as YAML.

The numbers are rounded to a micrometre and to six digits, so that every machine writes the same
bytes; ``make generate`` writes them, ``make fresh`` compares.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bioscara.model.parameters import GeometryParameters
from bioscara.model.parts import Link, Part, drawing
from bioscara.model.solids import Array, Inertial, Solid, weigh

FINISHES = ("printed", "metal")
"""Every link is drawn as two meshes: its printed parts, and its metal and rubber ones."""

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER = 80


def stl(solids: tuple[Solid, ...]) -> bytes:
    """Return solids as one binary STL file."""
    triangles = np.concatenate([solid.triangles for solid in solids]).round(6) + 0.0
    normals = np.concatenate([solid.doubled_areas() for solid in solids])
    records = np.zeros(len(triangles), _TRIANGLE)
    records["normal"] = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).round(5) + 0.0
    records["corners"] = triangles
    return bytes(_HEADER) + len(records).to_bytes(4, "little") + records.tobytes()


def read_stl(content: bytes) -> Array:
    """Return the triangles of a binary STL file, shape (n, 3 corners, 3)."""
    records = np.frombuffer(content, _TRIANGLE, offset=_HEADER + 4)
    return records["corners"].astype(np.float64)


def files(geometry: GeometryParameters) -> dict[str, bytes]:
    """Return every file generated from the drawing, by its path in the description."""
    links = drawing(geometry)
    out = {"links.yaml": _properties(links).encode()}
    for link in links:
        for finish, printed in zip(FINISHES, (True, False), strict=True):
            solids = tuple(part.solid for part in link.parts if part.printed is printed)
            out[f"meshes/visual/{link.name}_{finish}.stl"] = stl(solids)
        for name, part in _named(link):
            out[f"meshes/collision/{link.name}_{name}.stl"] = stl((part.solid,))
    return out


def _named(link: Link) -> Iterator[tuple[str, Part]]:
    """Yield the parts of a link with a name for each."""
    for name, parts in link.bodies.items():
        for number, part in enumerate(parts, 1):
            yield (name if len(parts) == 1 else f"{name}_{number}"), part


def _properties(links: tuple[Link, ...]) -> str:
    lines = [
        "# Generated from the drawing (bioscara.model.parts): the collision meshes of each link,",
        "# and estimates of its mass: printed parts are shells of PLA, motors and rods are solid.",
        "# kg, m and kg m^2; inertias about the centre of mass.",
    ]
    for link in links:
        lines += _lines(link.name, weigh(part.moments() for part in link.parts))
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
