"""Principal values and axes of a Mandel vector, and tensors given in those axes.

Compiled for one point at a time.  Jacobi rotations are used because they keep full
accuracy where principal values are close or equal.
"""

import numpy as np
from numba import njit

from umat.mandel import COLUMN, FACTOR, ROW

MAX_SWEEPS = 12


@njit(cache=True, nogil=True)
def principal_axes(vector, values, axes):
    """Fill the values (3,), largest first, and axes (3, 3), columns, of a Mandel vector.

    `vector` (6,) must be finite.
    """
    tensor = np.empty((3, 3))
    for a in range(6):
        tensor[ROW[a], COLUMN[a]] = tensor[COLUMN[a], ROW[a]] = vector[a] / FACTOR[a]
    axes[:] = 0.0
    for i in range(3):
        axes[i, i] = 1.0
    for _ in range(MAX_SWEEPS):
        moved = _rotate(tensor, axes, 0, 1)
        moved = _rotate(tensor, axes, 0, 2) or moved
        moved = _rotate(tensor, axes, 1, 2) or moved
        if not moved:
            break
    for i in range(3):
        values[i] = tensor[i, i]
    _sort(values, axes, 0, 1)
    _sort(values, axes, 1, 2)
    _sort(values, axes, 0, 1)


@njit(cache=True, nogil=True)
def _rotate(tensor, axes, i, j):
    """Turn axes i and j so that their entry vanishes; return whether it did not."""
    off = tensor[i, j]
    if abs(off) <= 1e-17 * (abs(tensor[i, i]) + abs(tensor[j, j])):
        tensor[i, j] = tensor[j, i] = 0.0
        return False
    ratio = (tensor[j, j] - tensor[i, i]) / (2.0 * off)
    t = 1.0 / (abs(ratio) + np.hypot(1.0, ratio))
    t = -t if ratio < 0.0 else t
    c = 1.0 / np.sqrt(1.0 + t * t)
    s = t * c
    k = 3 - i - j
    tensor[i, i] -= t * off
    tensor[j, j] += t * off
    tensor[i, j] = tensor[j, i] = 0.0
    at_i, at_j = tensor[k, i], tensor[k, j]
    tensor[k, i] = tensor[i, k] = c * at_i - s * at_j
    tensor[k, j] = tensor[j, k] = s * at_i + c * at_j
    for row in range(3):
        at_i, at_j = axes[row, i], axes[row, j]
        axes[row, i] = c * at_i - s * at_j
        axes[row, j] = s * at_i + c * at_j
    return True


@njit(cache=True, nogil=True)
def _sort(values, axes, i, j):
    if values[i] < values[j]:
        values[i], values[j] = values[j], values[i]
        for row in range(3):
            axes[row, i], axes[row, j] = axes[row, j], axes[row, i]


@njit(cache=True, nogil=True)
def fill_dyads(axes, dyads):
    """Fill the matrix (6, 6) that turns a Mandel vector from principal to global axes.

    Its first three columns are the dyads of the principal axes.
    """
    for a in range(6):
        i, j = ROW[a], COLUMN[a]
        for b in range(6):
            k, m = ROW[b], COLUMN[b]
            both = axes[i, k] * axes[j, m] + axes[i, m] * axes[j, k]
            dyads[a, b] = 0.5 * FACTOR[a] * FACTOR[b] * both


@njit(cache=True, nogil=True)
def fill_spectral(dyads, normal_part, shear_part, tangent):
    """Fill the (6, 6) matrix that has, in principal axes, a (3, 3) block and a diagonal.

    `shear_part` (3,) belongs to the components yz, xz, xy of the principal axes.
    """
    half = np.empty((6, 6))
    for a in range(6):
        for b in range(3):
            total = 0.0
            for c in range(3):
                total += dyads[a, c] * normal_part[c, b]
            half[a, b] = total
            half[a, 3 + b] = dyads[a, 3 + b] * shear_part[b]
    for a in range(6):
        for b in range(6):
            total = 0.0
            for c in range(6):
                total += half[a, c] * dyads[b, c]
            tangent[a, b] = total
