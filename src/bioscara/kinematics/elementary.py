"""Functions of arrays that give the same bits on every computer.

What enters a trajectory is computed by these, and by sums, differences, products, quotients and
square roots of real arrays, each of which IEEE 754 rounds in one way. Other results of NumPy depend
on the processor in their last bits: ``arctan2``, ``arccos`` and powers are those of Intel's library
where there is AVX-512, and of the C library elsewhere; products of complex numbers, ``interp`` and
``einsum`` round a * b + c once or twice; products of matrices and ``linalg.norm`` of a vector are
those of a BLAS library, which has code for each kind of processor.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def sin_cos(angles: Array) -> tuple[Array, Array]:
    """Return sines and cosines of angles [rad], by the C library: it has no vectors of these."""
    turned = np.exp(1j * angles)
    return turned.imag, turned.real


def arctan2(y: Array, x: Array) -> Array:
    """Return the angles from the x axis to points [rad], of the shape of both arrays."""
    angles = map(math.atan2, y.ravel().tolist(), x.ravel().tolist())
    return np.fromiter(angles, np.float64, y.size).reshape(y.shape)


def arccos(cosines: Array) -> Array:
    """Return angles from 0 to half a turn [rad]; NaN of a NaN, and of numbers beyond -1 and 1."""
    return arctan2(np.sqrt((1.0 - cosines) * (1.0 + cosines)), cosines)


def dot(one: Array, other: Array) -> float:
    """Return the scalar product of two vectors."""
    return float((one * other).sum())
