"""Symmetric second-order tensors as 6-vectors, and their invariants.

A symmetric tensor is the Mandel vector ``(xx, yy, zz, √2 yz, √2 xz, √2 xy)``, so that
the scalar product of two tensors is the dot product of their vectors and a fourth-order
tensor is an ordinary 6×6 matrix.  The factor √2 is written in this file only.  Every
function works on the last axis (or last two) and broadcasts over the others.
Compression is positive.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

ROW = np.array([0, 1, 2, 1, 0, 0])
COLUMN = np.array([0, 1, 2, 2, 2, 1])
FACTOR = np.sqrt([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
POSITION = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])

IDENTITY = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
SPHERICAL = np.outer(IDENTITY, IDENTITY) / 3.0
DEVIATORIC = np.eye(6) - SPHERICAL


def from_tensor(tensor: ArrayLike) -> Array:
    """Return the (..., 6) Mandel vector of the symmetric part of a (..., 3, 3) tensor."""
    tensor = np.asarray(tensor, dtype=float)
    symmetric = 0.5 * (tensor + np.swapaxes(tensor, -1, -2))
    return symmetric[..., ROW, COLUMN] * FACTOR


def to_tensor(vector: ArrayLike) -> Array:
    """Return the (..., 3, 3) symmetric tensor of a (..., 6) Mandel vector."""
    return (np.asarray(vector, dtype=float) / FACTOR)[..., POSITION]


def trace(vector: ArrayLike) -> Array:
    """Return the (...) trace."""
    return np.asarray(vector, dtype=float)[..., :3].sum(axis=-1)


def deviator(vector: ArrayLike) -> Array:
    """Return the (..., 6) deviatoric part."""
    vector = np.asarray(vector, dtype=float)
    return vector - trace(vector)[..., None] / 3.0 * IDENTITY


def dot(left: ArrayLike, right: ArrayLike) -> Array:
    """Return the (...) scalar product a:b."""
    return np.einsum("...i,...i->...", np.asarray(left, dtype=float), np.asarray(right, dtype=float))


def norm(vector: ArrayLike) -> Array:
    """Return the (...) Frobenius norm √(a:a)."""
    return np.sqrt(dot(vector, vector))


def p(stress: ArrayLike) -> Array:
    """Return the (...) mean pressure tr(σ)/3, in the unit of stress."""
    return trace(stress) / 3.0


def q(stress: ArrayLike) -> Array:
    """Return the (...) deviatoric stress √(3/2 s:s), in the unit of stress."""
    return np.sqrt(1.5) * norm(deviator(stress))


def eta(stress: ArrayLike) -> Array:
    """Return the (...) stress ratio q/p [-]; infinite or NaN where p = 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return q(stress) / p(stress)


def cos3theta(vector: ArrayLike) -> Array:
    """Return the (...) cosine of three times the Lode angle (θ), 27/2 det(s)/q³ [-].

    It is 1 in triaxial compression, −1 in extension, and by convention 1 where the
    deviator vanishes.
    """
    size = norm(deviator(vector))[..., None]
    unit = np.divide(deviator(vector), size, out=np.zeros(np.shape(vector)), where=size > 0.0)
    cosine = 3.0 * np.sqrt(6.0) * _determinant(unit)
    return np.where(size[..., 0] > 0.0, np.clip(cosine, -1.0, 1.0), 1.0)


def lode(vector: ArrayLike) -> Array:
    """Return the (...) Lode angle (θ) [degrees]: 0 compression, 60 extension."""
    return np.degrees(np.arccos(cos3theta(vector))) / 3.0


def principal(vector: ArrayLike) -> Array:
    """Return the (..., 3) principal values, largest (most compressive) first."""
    return np.asarray(np.linalg.eigvalsh(to_tensor(vector))[..., ::-1], dtype=float)


def rotation(matrix: ArrayLike) -> Array:
    """Return the (..., 6, 6) orthogonal matrix that turns a Mandel vector.

    With R the (..., 3, 3) rotation `matrix`, the vector of R a Rᵀ is the returned
    matrix times the vector of a.
    """
    matrix = np.asarray(matrix, dtype=float)
    rows, columns = matrix[..., ROW, :], matrix[..., COLUMN, :]
    straight = rows[..., ROW] * columns[..., COLUMN]
    crossed = rows[..., COLUMN] * columns[..., ROW]
    return 0.5 * (straight + crossed) * np.outer(FACTOR, FACTOR)


def _determinant(vector: Array) -> Array:
    xx, yy, zz, yz, xz, xy = np.moveaxis(vector / FACTOR, -1, 0)
    return xx * yy * zz + 2 * yz * xz * xy - xx * yz**2 - yy * xz**2 - zz * xy**2
