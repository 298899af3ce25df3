"""Types of the arrays that planning computes with."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
"""Numbers, in SI units."""
Index = npt.NDArray[np.intp]
"""Indices into other arrays."""
