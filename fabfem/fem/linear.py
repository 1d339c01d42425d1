"""Linear solvers behind one interface: factor a matrix whose pattern stays, solve, and check every answer.

A failure is a value: `solve` never raises and never hands on NaN. SuperLU needs nothing but scipy; PARDISO is in
`pardiso`.
"""

from importlib.util import find_spec
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, triu
from scipy.sparse.linalg import SuperLU, splu

from fabfem.fem.pardiso import PardisoBackend

POOR = 1e-10
"""Relative residual above which a solution is refined."""
REFINEMENTS = 3
"""Times that it is, at most."""
USELESS = 1e-6
"""Relative residual above which a solution is refused."""
OVERFLOW = 1e14
"""Solution over right-hand side, scaled to a unit diagonal, above which the matrix is as good as singular."""


NO_MATRIX = "no matrix was given"


def norm(vector: np.ndarray) -> float:
    """Euclidean length; without BLAS, whose threads wait for those of PARDISO (5.5 ms against 0.15 at 81k dofs)."""
    return float(np.sqrt(np.square(vector).sum()))


class Solution(NamedTuple):
    """Answer of a linear solve."""

    x: np.ndarray
    """Solution; zero where there is none."""
    residual: float
    """Norm of the residual over the norm of the right-hand side."""
    ok: bool
    reason: str
    """Why not, in a sentence; empty when ok."""


class Backend(Protocol):
    """What a direct solver offers; both may raise ArithmeticError with a reason."""

    name: str
    triangle: bool

    def factor(self, matrix: csr_matrix, fresh: bool) -> None:
        """Factor a CSR matrix; `fresh` asks to forget what was learnt from earlier ones."""

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """Solve with the last factors."""

    def forget(self) -> None:
        """Let the last matrix go."""


class LinearSolver(Protocol):
    """What the Newton iteration needs; a distributed solver implements the same functions."""

    name: str
    triangle: bool
    """Whether matrices are symmetric and given as their upper triangle alone."""

    def factor(self, matrix: csr_matrix) -> None:
        """Take a new matrix."""

    def solve(self, rhs: np.ndarray) -> Solution:
        """Solve with the last matrix."""

    def forget(self) -> None:
        """Let the last matrix go, before another takes its room."""


class DirectSolver:
    """Checks and refinement around a backend."""

    def __init__(self, backend: Backend) -> None:
        self.name, self.triangle = backend.name, backend.triangle
        self._backend = backend
        self._matrix = csr_matrix((0, 0))
        self._diagonal = self._scale = np.zeros(0)
        self._failure = NO_MATRIX

    def forget(self) -> None:
        """Let the last matrix go."""
        self._matrix, self._failure = csr_matrix((0, 0)), NO_MATRIX
        self._backend.forget()

    def factor(self, matrix: csr_matrix) -> None:
        """Factor `matrix`; a failure shows in the next `solve`."""
        self._matrix, self._diagonal = matrix, matrix.diagonal()
        self._scale = np.sqrt(np.abs(self._diagonal))
        self._failure = "" if np.isfinite(matrix.data).all() else "the stiffness matrix is not finite"
        self._try_factor(fresh=False)

    def solve(self, rhs: np.ndarray) -> Solution:
        """Solve, refine where poor, factor anew where still poor."""
        if not np.isfinite(rhs).all():
            return Solution(np.zeros_like(rhs), np.inf, False, "the right-hand side is not finite")
        if not rhs.any():
            return Solution(np.zeros_like(rhs), 0.0, not self._failure, self._failure)
        x, residual = self._refined(rhs)
        if residual > USELESS and not self._failure:
            self._try_factor(fresh=True)
            x, residual = self._refined(rhs)
        growth = self._growth(x, rhs) if residual <= USELESS else np.inf
        if growth < OVERFLOW:
            return Solution(x, residual, True, "")
        what = f"residual {residual:.1e}" if residual > USELESS else f"it moves {growth:.1e} times too far"
        reason = self._failure or f"the stiffness matrix is singular or nearly so ({what})"
        return Solution(np.zeros_like(rhs), residual, False, reason)

    def _try_factor(self, fresh: bool) -> None:
        if not self._failure:
            try:
                self._backend.factor(self._matrix, fresh)
            except ArithmeticError as error:
                self._failure = str(error)

    def _refined(self, rhs: np.ndarray) -> tuple[np.ndarray, float]:
        if self._failure:
            return np.zeros_like(rhs), np.inf
        x = self._backend.solve(rhs)
        residual = self._residual(x, rhs)
        for _ in range(REFINEMENTS):
            if residual <= POOR or not np.isfinite(residual):
                break
            better = x + self._backend.solve(rhs - self._product(x))
            x, residual = min(((x, residual), (better, self._residual(better, rhs))), key=lambda pair: pair[1])
        return x, residual

    def _growth(self, x: np.ndarray, rhs: np.ndarray) -> float:
        """The solution over the right-hand side, both scaled as a unit diagonal would be: a bound of the condition."""
        there = self._scale > 0.0
        moved, pushed = norm(self._scale * x), norm(rhs[there] / self._scale[there])
        return moved / pushed if pushed > 0.0 else 0.0

    def _residual(self, x: np.ndarray, rhs: np.ndarray) -> float:
        with np.errstate(over="ignore", invalid="ignore"):
            size = norm(rhs - self._product(x)) / norm(rhs)
        return size if np.isfinite(size) else np.inf

    def _product(self, x: np.ndarray) -> np.ndarray:
        if not self.triangle:
            return self._matrix @ x
        return self._matrix @ x + self._matrix.T @ x - self._diagonal * x


def whole(matrix: csr_matrix, triangle: bool) -> csr_matrix:
    """A matrix of which an upper triangle may be all that is given."""
    return csr_matrix(matrix + triu(matrix, 1).T) if triangle else matrix


class SuperLUBackend:
    """scipy's SuperLU, ordered for a symmetric pattern."""

    name = "superlu"
    triangle = False

    def __init__(self) -> None:
        self._factors: SuperLU | None = None

    def factor(self, matrix: csr_matrix, fresh: bool) -> None:
        """Factor the transpose, which CSR arrays are when read as CSC; `fresh` pivots by size instead of order."""
        transposed = csc_matrix((matrix.data, matrix.indices, matrix.indptr), shape=matrix.shape)
        options: dict[str, Any] = {"permc_spec": "COLAMD"} if fresh else _SYMMETRIC_PATTERN
        self._factors = None
        try:
            self._factors = splu(transposed, **options)
        except RuntimeError as error:
            raise ArithmeticError(f"the stiffness matrix is singular ({error})") from error

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """Solve with the transposed factors."""
        assert self._factors is not None
        return self._factors.solve(rhs, trans="T")

    def forget(self) -> None:
        """Let the last factors go, for they are made anew."""
        self._factors = None


_SYMMETRIC_PATTERN: dict[str, Any] = {
    "permc_spec": "MMD_AT_PLUS_A",
    "diag_pivot_thresh": 1e-3,
    "options": {"SymmetricMode": True},
}


def make_solver(name: str = "auto", symmetric: bool = False, coupled: bool = False) -> LinearSolver:
    """The solver called `name`: "superlu", "pardiso", or "auto" for PARDISO where it is installed.

    `symmetric` promises symmetric matrices, `coupled` warns of unknowns of two kinds. Raises ValueError for an unknown
    or missing solver.
    """
    installed = find_spec("pypardiso") is not None
    if name == "auto":
        name = "pardiso" if installed else "superlu"
    if name not in ("superlu", "pardiso"):
        raise ValueError(f"there is no linear solver '{name}'; there are auto, superlu, pardiso, multigrid.")
    if name == "pardiso" and not installed:
        raise ValueError("the linear solver 'pardiso' is not installed; pip install 'fabfem[fast]' brings it.")
    return DirectSolver(PardisoBackend(symmetric, coupled) if name == "pardiso" else SuperLUBackend())
