"""Meshes of the description, as binary STL."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""Record of one triangle."""
HEADER = 80
"""Bytes of free text before the number of triangles."""


def read_stl(content: bytes) -> npt.NDArray[np.float64]:
    """Return the triangles of a binary STL file, shape (n, 3 corners, 3)."""
    records = np.frombuffer(content, TRIANGLE, offset=HEADER + 4)
    return records["corners"].astype(np.float64)
