"""The condition of a matrix of PETSc that all ranks share, from solves with its factors and their transposes."""

import numpy as np
from petsc4py import PETSc

from fabfem.fem.diagnosis import inverse_norm
from fabfem.fem.ranks import Alone


def condition_number(matrix: PETSc.Mat, ksp: PETSc.KSP, ranks: Alone) -> float:
    """Return ‖K‖₁ ‖K⁻¹‖₁ of a matrix scaled to a unit diagonal, as `fabfem.fem.diagnosis` has it for one rank.

    Parameters
    ----------
    matrix : Mat
        It stays as it is.
    ksp : KSP
        Solves with it directly.
    ranks : Alone
        Who shares it.

    Returns
    -------
    float
        Infinite where the matrix is singular.
    """
    x, b = matrix.createVecs()
    size, scaled = _size(matrix), matrix.copy()
    b.array[:] = 1.0 / size
    scaled.diagonalScale(b, b)

    def solve(rhs: np.ndarray) -> np.ndarray:
        b.array[:] = size * rhs
        ksp.solve(b, x)
        return size * x.array

    def transposed(rhs: np.ndarray) -> np.ndarray:
        b.array[:] = size * rhs
        ksp.solveTranspose(b, x)
        return size * x.array

    try:
        ksp.setOperators(matrix)
        inverse = inverse_norm(solve, transposed, len(size), ranks, matrix.getOwnershipRange()[0])
        number = float(scaled.norm(PETSc.NormType.NORM_1) * inverse)
    except PETSc.Error:
        number = np.inf
    scaled.destroy()
    return number if np.isfinite(number) else np.inf


def _size(matrix: PETSc.Mat) -> np.ndarray:
    """Return the square root of the diagonal; of the largest entry of the row where the diagonal is next to nothing."""
    first, last = matrix.getOwnershipRange()
    diagonal = np.sqrt(np.abs(matrix.getDiagonal().array))
    rows = np.sqrt([np.abs(matrix.getRow(row)[1]).max(initial=0.0) for row in range(first, last)])
    return np.where(diagonal > 1e-8 * rows, diagonal, np.where(rows > 0.0, rows, 1.0))
