"""The convex solids that the arm's visual meshes consist of, as shapes of coal.

A triangle surface inside a closed one crosses nothing, so meshes alone would miss a finger that is
wholly inside the column. Each mesh is a list of closed convex surfaces; they are taken apart here,
and each becomes a convex body, which has an inside.
"""

from __future__ import annotations

from collections import Counter
from typing import Any, NamedTuple

import coal
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_WELD = 1e-6
"""The meshes are rounded to this [m]."""


class Solid(NamedTuple):
    """A convex body of a link.

    Attributes:
        link: Name of the link.
        corners: Its corners in the frame of the link [m], shape (n, 3).
        shape: The same for coal.
    """

    link: str
    corners: Array
    shape: Any


def split(triangles: Array) -> list[Array]:
    """Return the closed surfaces that follow each other in a mesh.

    A surface is closed once each of its edges was passed in both directions.

    Args:
        triangles: Of the mesh [m], shape (n, 3 corners, 3).

    Raises:
        ValueError: The mesh ends before its last surface is closed.
    """
    open_edges: Counter[tuple[tuple[int, ...], tuple[int, ...]]] = Counter()
    parts, begin = [], 0
    for number, triangle in enumerate(np.round(triangles / _WELD).astype(int).tolist()):
        corners = [tuple(corner) for corner in triangle]
        for one, other in zip(corners, corners[1:] + corners[:1], strict=True):
            if open_edges[other, one]:
                open_edges[other, one] -= 1
            else:
                open_edges[one, other] += 1
        open_edges += Counter()
        if not open_edges:
            parts.append(triangles[begin : number + 1])
            begin = number + 1
    if begin != len(triangles):
        raise ValueError(f"the last {len(triangles) - begin} triangles are not a closed surface")
    return parts


def bulge(triangles: Array) -> float:
    """Return the largest distance of a corner outside one of the faces [m]; 0 when convex."""
    first, second, third = np.moveaxis(triangles, 1, 0)
    normals = np.cross(second - first, third - first)
    areas = np.linalg.norm(normals, axis=1)
    thin = areas < 1e-12
    normals = normals[~thin] / areas[~thin, None]
    outside = triangles.reshape(-1, 3) @ normals.T - np.einsum("ij,ij->i", normals, first[~thin])
    return float(outside.max())


def volume(triangles: Array) -> float:
    """Return the volume of a closed surface [m^3]."""
    return float(np.linalg.det(triangles).sum() / 6.0)


def solid(link: str, corners: Array) -> Solid:
    """Return the convex hull of some corners as a body of a link."""
    unique = np.unique(corners.reshape(-1, 3), axis=0)
    points = coal.StdVec_Vec3s()
    points.extend(list(unique))
    return Solid(link, unique, coal.Convex.convexHull(points, False, "Qt"))
