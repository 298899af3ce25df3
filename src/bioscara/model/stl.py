"""Binary STL, the form of the description's meshes."""

from __future__ import annotations

import numpy as np

from bioscara.model.solids import Array

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""Record of one triangle."""
HEADER = 80
"""Bytes of free text before the number of triangles."""


def read_stl(content: bytes) -> Array:
    """Return the triangles of a binary STL file, shape (n, 3 corners, 3)."""
    records = np.frombuffer(content, TRIANGLE, offset=HEADER + 4)
    return records["corners"].astype(np.float64)
