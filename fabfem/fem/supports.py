"""What is held: displacement components of boundaries, fixed or moved by a ramp.

A rigid rough footing is two supports on one boundary (both components), a smooth one only the normal component.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from fabfem.fem.assembly import Pattern
from fabfem.fem.space import Space


@dataclass(frozen=True)
class Support:
    """One held component of a boundary; `displacement` [length] is added in equal parts over the stage."""

    boundary: str
    component: str
    displacement: float = 0.0


@dataclass(frozen=True)
class Constraints:
    """Held dofs of a stage.

    Attributes
    ----------
    held : (m,) array
        Dofs, ascending.
    motion : (m,) array
        What each moves over the whole stage.
    free : (ndof - m,) array
        The other dofs.
    """

    held: np.ndarray
    motion: np.ndarray
    free: np.ndarray


def constrain(space: Space, supports: Sequence[Support]) -> Constraints:
    """The held dofs of `supports`.

    Raises ValueError where two supports contradict each other or the body can still move as a rigid one.
    """
    moved: dict[int, float] = {}
    for support in supports:
        for dof in space.dofs_on(support.boundary, support.component).tolist():
            if moved.setdefault(dof, support.displacement) != support.displacement:
                raise ValueError(
                    f"boundary '{support.boundary}' moves {support.component} by {support.displacement:g}, "
                    f"but a node of it is already moved by {moved[dof]:g} by another support."
                )
    held = np.array(sorted(moved), dtype=int)
    _refuse_rigid_motion(space, held)
    free = np.setdiff1d(np.arange(space.ndof), held)
    return Constraints(held, np.array([moved[dof] for dof in held]), free)


def _refuse_rigid_motion(space: Space, held: np.ndarray) -> None:
    points = space.mesh.points
    size = float(np.ptp(points, axis=0).max())
    centred = (points - points.mean(axis=0) * (not space.kinematics.radial)) / size
    modes = space.kinematics.modes(centred).reshape(-1, space.ndof)
    loose = len(modes) - (np.linalg.matrix_rank(modes[:, held], tol=1e-9) if len(held) else 0)
    if loose:
        motions = "one rigid motion" if loose == 1 else f"{loose} rigid motions"
        raise ValueError(f"the supports leave {motions} of the body free; hold more components.")


@dataclass(frozen=True)
class Reduction:
    """The free-free block of a matrix of known pattern, itself of one fixed pattern."""

    pattern: Pattern
    keep: np.ndarray

    def __call__(self, matrix: csr_matrix) -> csr_matrix:
        """The block of `matrix`."""
        return self.pattern.matrix(matrix.data[self.keep])


def reduction(pattern: Pattern, constraints: Constraints) -> Reduction:
    """How to cut the free-free block out of matrices of `pattern`."""
    ndof = len(pattern.indptr) - 1
    number = np.full(ndof, -1, np.int32)
    number[constraints.free] = np.arange(len(constraints.free), dtype=np.int32)
    rows = np.repeat(number, np.diff(pattern.indptr))
    columns = number[pattern.indices]
    keep = np.flatnonzero((rows >= 0) & (columns >= 0))
    counts = np.bincount(rows[keep], minlength=len(constraints.free))
    indptr = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    return Reduction(Pattern(indptr, columns[keep], np.zeros((0, 0, 0), np.int32)), keep)
