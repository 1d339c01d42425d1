"""The linear systems of all ranks on PETSc: MUMPS, or FGMRES with algebraic multigrid.

PETSc's system has a row for every dof, so that the rows of a node are one block: the rows of held and absent dofs, and
of those that follow rigid bodies, are a diagonal entry of the others' size. Each rank has the rows of the nodes that it
owns, displacements first, then pressures; the first rank also those of the motions of rigid bodies.

Multigrid smooths aggregates of nodes (GAMG) and is told the rigid motions as the near null space [Vaněk, Mandel &
Brezina 1996]; with pore pressure the two fields are split, the pressure's Schur complement approximated with the
diagonal of the stiffness. Its solves are as exact as the Newton iteration can use (`forcing`). Where it does not
converge, as the tangent of a body that fails, that one solve is MUMPS's.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from fabfem.fem.constraints import Constraints
from fabfem.fem.linear import OVERFLOW, POOR, REFINEMENTS, USELESS, Solution
from fabfem.fem.porous_space import PorousSpace
from fabfem.fem.space import Space
from fabfem.parallel.condition import condition_number
from fabfem.parallel.forcing import MOST, forcing
from fabfem.parallel.rows import Rows

DIRECT: dict[str, Any] = {
    "ksp_type": "preonly",
    "pc_type": "lu",
    "pc_factor_mat_solver_type": "mumps",
    "mat_mumps_icntl_14": 60,  # room for pivoting, per cent
}
# Jacobi, since an aggregate of held nodes leaves blocks on the coarser levels that SOR finds singular
MULTIGRID: dict[str, Any] = {
    "ksp_type": "fgmres",
    "ksp_gmres_restart": 100,
    "ksp_max_it": 300,
    "pc_type": "gamg",
    "pc_gamg_threshold": 0.01,
    "mg_levels_ksp_type": "chebyshev",
    "mg_levels_ksp_max_it": 3,
    "mg_levels_pc_type": "jacobi",
}
SPLIT: dict[str, Any] = {
    "ksp_type": "fgmres",
    "ksp_gmres_restart": 100,
    "ksp_max_it": 300,
    "pc_type": "fieldsplit",
    "pc_fieldsplit_type": "schur",
    "pc_fieldsplit_schur_fact_type": "upper",
    "pc_fieldsplit_schur_precondition": "selfp",
    "fieldsplit_motion_ksp_type": "preonly",
    "fieldsplit_motion_pc_type": "gamg",
    "fieldsplit_motion_pc_gamg_threshold": 0.01,
    "fieldsplit_motion_mg_levels_ksp_type": "chebyshev",
    "fieldsplit_motion_mg_levels_ksp_max_it": 3,
    "fieldsplit_motion_mg_levels_pc_type": "jacobi",
    "fieldsplit_pressure_ksp_type": "preonly",
    "fieldsplit_pressure_pc_type": "bjacobi",
}


class Settings(NamedTuple):
    """What the linear solvers of a run are made with."""

    multigrid: bool = False
    options: Mapping[str, Any] = {}
    """PETSc's options, which go before the program's own."""


class PetscSolver:
    """A linear solver with the interface of `fabfem.fem.linear.LinearSolver` on the unknowns of a rank."""

    triangle = False

    def __init__(
        self, comm: MPI.Comm, constraints: Constraints, space: Space, settings: Settings, spent: dict[str, float]
    ) -> None:
        self.name = "multigrid" if settings.multigrid else "mumps"
        self._spent = spent
        self._comm, self._settings = comm, settings
        self._rows = Rows(comm, constraints, space)
        self._space = space
        self._matrix: PETSc.Mat | None = None
        self._ksp: PETSc.KSP | None = None
        self._failure = "no matrix was given"
        self._new, self._last, self._wanted = True, 0.0, MOST

    def factor(self, matrix: csr_matrix) -> None:
        """Take a new matrix, this rank's share of it; a failure shows in the next `solve`."""
        finite = self._comm.allreduce(bool(np.isfinite(matrix.data).all()), MPI.LAND)
        self._failure = "" if finite else "the stiffness matrix is not finite"
        if not finite:
            return
        _release_others(self)
        self._new = True
        self._matrix = self._rows.matrix(matrix, self._matrix)
        if self._ksp is not None:
            self._ksp.setOperators(self._matrix)

    def solve(self, rhs: np.ndarray) -> Solution:
        """Solve with the last matrix."""
        nothing = np.zeros_like(rhs)
        b = self._rows.vector(rhs)
        size = b.norm()
        if not np.isfinite(size):
            return Solution(nothing, np.inf, False, "the right-hand side is not finite")
        if size == 0.0 or self._failure:
            return Solution(nothing, 0.0, not self._failure, self._failure)
        self._spent["solves"] += 1
        wanted = self._tolerance(size)
        x, residual = self._solved(b, size, wanted)
        growth = self._growth(x, b) if residual <= max(USELESS, 2.0 * wanted) else np.inf
        if growth < OVERFLOW:
            return Solution(self._rows.unknowns(x), residual, True, "")
        what = f"residual {residual:.1e}" if growth == np.inf else f"it moves {growth:.1e} times too far"
        return Solution(nothing, residual, False, f"the stiffness matrix is singular or nearly so ({what})")

    def forget(self) -> None:
        """Keep the matrix: the next one takes its place."""

    def condition(self, matrix: csr_matrix) -> float:
        """Return the condition number of a matrix, scaled to a unit diagonal; infinite where it is singular."""
        self.factor(matrix)
        if self._failure or self._matrix is None:
            return np.inf
        ksp = self._made(multigrid=False)
        number = condition_number(self._matrix, ksp, self._space.mesh.ranks)
        ksp.destroy()
        return number

    def release(self) -> None:
        """Give back the matrix and its factors."""
        for thing in (self._ksp, self._matrix):
            if thing is not None:
                thing.destroy()
        self._ksp = self._matrix = None

    def _tolerance(self, size: float) -> float:
        """Return the relative residual that is asked of an iterative solve; a direct one's is its own affair.

        The first solve with a matrix is for the out-of-balance force; another, as for the load that a control scales,
        is as exact.
        """
        if not self._settings.multigrid:
            return 0.0
        if self._new:
            self._wanted, self._last, self._new = forcing(size, self._last), size, False
        return self._wanted

    def _solved(self, b: PETSc.Vec, size: float, wanted: float) -> tuple[PETSc.Vec, float]:
        """Return the solution and its relative residual: of the iteration, else refined once by a direct solver."""
        if self._ksp is None:
            self._ksp = self._made(self._settings.multigrid)
            self._ksp.setOperators(self._matrix)
        if self._settings.multigrid:
            self._ksp.setTolerances(rtol=0.5 * wanted, atol=0.0)
            x, residual = self._tried(self._ksp, b, size)
            if residual <= wanted:
                return x, residual
            self._spent["direct_instead"] += 1
            direct = self._made(multigrid=False)
            direct.setOperators(self._matrix)
            x, residual = self._refined(direct, b, size)
            direct.destroy()
            return x, residual
        return self._refined(self._ksp, b, size)

    def _refined(self, ksp: PETSc.KSP, b: PETSc.Vec, size: float) -> tuple[PETSc.Vec, float]:
        x, residual = self._tried(ksp, b, size)
        for _ in range(REFINEMENTS):
            if not POOR < residual < np.inf:
                break
            again = self._tried(ksp, self._left(x, b), size)[0]
            again.axpy(1.0, x)
            better = self._left(again, b).norm() / size
            if not better < residual:
                break
            x, residual = again, float(better)
        return x, residual

    def _tried(self, ksp: PETSc.KSP, b: PETSc.Vec, size: float) -> tuple[PETSc.Vec, float]:
        x = b.duplicate()
        x.set(0.0)
        try:
            ksp.solve(b, x)
        except PETSc.Error:
            self._forget(ksp)
            return x, np.inf
        self._spent["linear_iterations"] += ksp.getIterationNumber()
        if ksp.getConvergedReason() == PETSc.KSP.ConvergedReason.DIVERGED_PCSETUP_FAILED:
            self._forget(ksp)
        residual = self._left(x, b).norm() / size
        return x, float(residual) if np.isfinite(residual) else np.inf

    def _forget(self, ksp: Any) -> None:
        """Let the next solve make a new solver: one that has broken off solves nothing more, whatever the matrix."""
        if self._ksp is not None and ksp is self._ksp:
            ksp.destroy()
            self._ksp = None

    def _left(self, x: PETSc.Vec, b: PETSc.Vec) -> PETSc.Vec:
        assert self._matrix is not None
        left = b.duplicate()
        self._matrix.mult(x, left)
        left.aypx(-1.0, b)
        return left

    def _growth(self, x: PETSc.Vec, b: PETSc.Vec) -> float:
        """Return the solution over the right-hand side, both scaled as a unit diagonal would be."""
        assert self._matrix is not None
        diagonal = np.abs(self._matrix.getDiagonal().array)
        there = diagonal > 0.0
        scale = np.sqrt(diagonal[there])
        moved, pushed = (
            self._comm.allreduce(float(np.square(part).sum()))
            for part in (scale * x.array[there], b.array[there] / scale)
        )
        return float(np.sqrt(moved / pushed)) if pushed > 0.0 else 0.0

    def _made(self, multigrid: bool) -> PETSc.KSP:
        split = multigrid and isinstance(self._space, PorousSpace)
        options = dict(SPLIT if split else MULTIGRID if multigrid else DIRECT)
        if multigrid == self._settings.multigrid:
            options |= self._settings.options
        prefix, table = f"fabfem_{self.name}_{int(multigrid)}_", PETSc.Options()
        for name, value in options.items():
            table[prefix + name] = value
        ksp = PETSc.KSP().create(self._comm)
        ksp.setOptionsPrefix(prefix)
        if multigrid:
            self._rows.tell_motions(self._matrix)
        if split:
            ksp.getPC().setType("fieldsplit")
            ksp.getPC().setFieldSplitIS(*self._rows.fields(self._matrix))
        ksp.setFromOptions()
        return ksp


_holder: list[PetscSolver] = []


def _release_others(solver: PetscSolver) -> None:
    """Let one stage at a time hold factors."""
    if not _holder or _holder[0] is not solver:
        for other in _holder:
            other.release()
        _holder[:] = [solver]
