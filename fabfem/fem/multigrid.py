"""An iterative solver for solids: a Krylov method with multigrid of the elastic stiffness.

Smoothed aggregation [Vaněk, Mandel & Brezina 1996], by pyamg, needs the elastic stiffness in blocks of one node and the
rigid motions. It is made once for a stage, from the elastic tangents of the initial states, and stays: so an answer
depends on the matrix and right-hand side alone, not on what was solved before. Symmetric stiffnesses are solved by
conjugate gradients, others by GMRES. Near failure the stiffness has little to do with the elastic one: a matrix that
the iteration does not solve in `PATIENCE` iterations is handed to a direct solver.

The unknowns are put where whole nodes leave room: a held dof becomes an unknown of its own, without neighbours.
"""

from collections.abc import Callable
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_matrix, triu
from scipy.sparse.linalg import LinearOperator, cg, gmres

from fabfem.fem.constraints import Constraints
from fabfem.fem.linear import LinearSolver, Solution, norm
from fabfem.fem.space import Space

MANY = 30_000
"""Unknowns of a solid from which it takes less time than a direct solver; `docs/performance.md`."""
EXACT = 1e-3
"""Relative residual of a solution: Newton's corrections need no more."""
PATIENCE = 150
"""Iterations after which a direct solver takes over."""
RESTART = 50
"""Vectors that GMRES keeps."""


class Near(NamedTuple):
    """A stiffness whose multigrid solves others like it."""

    matrix: csr_matrix
    """Stiffness of the unknowns."""
    modes: np.ndarray
    """(n, nmode) rigid motions, of the unknowns."""
    places: np.ndarray
    """(n,) place of each unknown among those of whole nodes."""
    block: int
    """Unknowns of a node."""
    size: int
    """Places in all."""


def near(space: Space, constraints: Constraints, matrix: csr_matrix) -> Near:
    """The stiffness of the unknowns, with what multigrid has to know of it."""
    block, ntied = len(space.components), constraints.ties.shape[1]
    modes = space.kinematics.modes(space.mesh.points - space.mesh.points.mean(axis=0)).reshape(-1, space.ndof).T
    tied = np.linalg.lstsq(constraints.ties, modes[constraints.tied])[0] if ntied else np.zeros((0, modes.shape[1]))
    places = np.concatenate([constraints.free, space.ndof + np.arange(ntied)])
    size = space.ndof + -(-ntied // block) * block
    return Near(matrix, np.concatenate([modes[constraints.free], tied]), places, block, size)


def worth_while(space: Space, constraints: Constraints) -> bool:
    """Whether multigrid takes less time than a direct solver, and is installed."""
    return space.mesh.dim == 3 and len(constraints.free) >= MANY and find_spec("pyamg") is not None


class MultigridSolver:
    """Krylov method with multigrid, and the direct solver behind it.

    Parameters
    ----------
    near : function
        Makes the `Near` when it is first needed.
    direct : LinearSolver
        Solves what multigrid does not.
    symmetric : bool
        Whether all matrices will be.
    """

    name = "multigrid"
    triangle = False

    def __init__(self, near: Callable[[], Near], direct: LinearSolver, symmetric: bool) -> None:
        self._near, self._direct, self._symmetric = near, direct, symmetric
        self._cycle: LinearOperator | None = None
        self._matrix = csr_matrix((0, 0))
        self._handed_on = False

    def factor(self, matrix: csr_matrix) -> None:
        """Take a new matrix."""
        self._matrix, self._handed_on = matrix, False

    def forget(self) -> None:
        """Let the last matrix go."""
        self._matrix = csr_matrix((0, 0))
        self._direct.forget()

    def solve(self, rhs: np.ndarray) -> Solution:
        """Solve with the last matrix, directly where the iteration does not come to an end."""
        if not self._handed_on:
            answer = self._iterated(rhs)
            if answer.ok or not np.isfinite(rhs).all():
                return answer
            self._handed_on = True
            self._direct.factor(triu(self._matrix, format="csr") if self._direct.triangle else self._matrix)
        return self._direct.solve(rhs)

    def _iterated(self, rhs: np.ndarray) -> Solution:
        nothing = np.zeros_like(rhs)
        if not np.isfinite(rhs).all():
            return Solution(nothing, np.inf, False, "the right-hand side is not finite")
        if not np.isfinite(self._matrix.data).all():
            return Solution(nothing, np.inf, False, "the stiffness matrix is not finite")
        if not rhs.any():
            return Solution(nothing, 0.0, True, "")
        if self._cycle is None:
            self._cycle = cycle(self._near())
        x = _krylov(self._matrix, rhs, self._cycle, self._symmetric)
        residual = norm(rhs - self._matrix @ x) / norm(rhs)
        if residual <= 2.0 * EXACT:
            return Solution(x, residual, True, "")
        return Solution(nothing, residual, False, f"the iteration leaves a residual of {residual:.1e}")


def cycle(near: Near) -> LinearOperator:
    """One V-cycle of multigrid of a stiffness, as an operator on its unknowns."""
    from pyamg import smoothed_aggregation_solver

    smoother = ("chebyshev", {"degree": 2})
    places, size, shape = near.places, near.size, near.matrix.shape
    modes = np.zeros((size, near.modes.shape[1]))
    modes[places] = near.modes
    blocks = _padded(near).tobsr((near.block, near.block))
    del near  # its matrix is large
    with _same_random_numbers():
        levels = smoothed_aggregation_solver(
            blocks,
            B=modes,
            strength=("symmetric", {"theta": 0.05}),
            improve_candidates=None,
            presmoother=smoother,
            postsmoother=smoother,
            max_coarse=300,
        )
    whole = levels.aspreconditioner()

    def apply(rhs: np.ndarray) -> np.ndarray:
        padded = np.zeros(size)
        padded[places] = rhs
        return (whole @ padded)[places]

    return LinearOperator(shape, apply, dtype=float)


def _padded(near: Near) -> csr_matrix:
    """The matrix at the places of its unknowns, with a usual diagonal at the others."""
    matrix, n = near.matrix, near.size
    counts = np.ones(n, np.int64)
    counts[near.places] = np.diff(matrix.indptr)
    indptr = np.concatenate([[0], np.cumsum(counts)])
    own = np.zeros(n, bool)
    own[near.places] = True
    taken = np.repeat(own, counts)
    indices, data = np.empty(indptr[-1], np.int32), np.full(indptr[-1], np.median(matrix.diagonal()))
    indices[taken], data[taken] = near.places[matrix.indices], matrix.data
    indices[~taken] = np.flatnonzero(~own)
    return csr_matrix((data, indices, indptr.astype(np.int32)), shape=(n, n))


@contextmanager
def _same_random_numbers() -> Any:
    """The estimates of spectral radii begin with numpy's global random numbers: those of one seed, then as before."""
    state = np.random.get_state()  # noqa: NPY002
    np.random.seed(0)  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(state)  # noqa: NPY002


def _krylov(matrix: csr_matrix, rhs: np.ndarray, cycle: LinearOperator, symmetric: bool) -> np.ndarray:
    """The solution of the iteration, whether it came to an end or not."""
    with np.errstate(all="ignore"):
        if symmetric:
            x, _ = cg(matrix, rhs, rtol=EXACT, maxiter=PATIENCE, M=cycle)
        else:
            x, _ = gmres(matrix, rhs, rtol=EXACT, restart=RESTART, maxiter=PATIENCE // RESTART, M=cycle)
    return x if np.isfinite(x).all() else np.zeros_like(rhs)
