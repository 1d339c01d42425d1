"""The linear systems of all ranks on PETSc: MUMPS, or FGMRES with algebraic multigrid.

PETSc's system has a row for every dof, so that the rows of a node are one block: the rows of held and absent dofs, and
of those that follow rigid bodies, are a diagonal entry of the others' size. Each rank has the rows of the nodes that it
owns, displacements first, then pressures; the first rank also those of the motions of rigid bodies.

Multigrid smooths aggregates of nodes (GAMG) and is told the rigid motions as the near null space [Vaněk, Mandel &
Brezina 1996]; with pore pressure the two fields are split, the pressure's Schur complement approximated with the
diagonal of the stiffness. Its solves are as exact as the Newton iteration can use [Eisenstat & Walker 1996]: the
residual is to fall to GAMMA times the square of what the last correction left of the out-of-balance force, within
(LEAST, MOST). Where it does not converge, as the tangent of a body that fails, that one solve is MUMPS's.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from fabfem.fem.linear import OVERFLOW, POOR, USELESS, Solution
from fabfem.fem.pores import PorousSpace
from fabfem.fem.space import Space
from fabfem.fem.supports import Constraints

GAMMA, LEAST, MOST = 0.5, 1e-8, 1e-3
"""Factor and bounds of the tolerance of an iterative solve."""
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
        self._failure, self._last = "no matrix was given", 0.0

    def factor(self, matrix: csr_matrix) -> None:
        """Take a new matrix, this rank's share of it; a failure shows in the next `solve`."""
        finite = self._comm.allreduce(bool(np.isfinite(matrix.data).all()), MPI.LAND)
        self._failure = "" if finite else "the stiffness matrix is not finite"
        if not finite:
            return
        _release_others(self)
        self._matrix = self._rows.matrix(matrix, self._matrix)
        if self._ksp is None:
            self._ksp = self._made(self._settings.multigrid)
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

    def release(self) -> None:
        """Give back the matrix and its factors."""
        for thing in (self._ksp, self._matrix):
            if thing is not None:
                thing.destroy()
        self._ksp = self._matrix = None

    def _tolerance(self, size: float) -> float:
        """Return the relative residual that is asked of an iterative solve; a direct one's is its own affair."""
        if not self._settings.multigrid:
            return 0.0
        left, self._last = (size / self._last if self._last else 1.0), size
        return float(np.clip(GAMMA * left**2, LEAST, MOST))

    def _solved(self, b: PETSc.Vec, size: float, wanted: float) -> tuple[PETSc.Vec, float]:
        """Return the solution and its relative residual: of the iteration, else refined once by a direct solver."""
        assert self._ksp is not None
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
        if POOR < residual < np.inf:
            again, _ = self._tried(ksp, self._left(x, b), size)
            again.axpy(1.0, x)
            better = self._left(again, b).norm() / size
            if better < residual:
                return again, better
        return x, residual

    def _tried(self, ksp: PETSc.KSP, b: PETSc.Vec, size: float) -> tuple[PETSc.Vec, float]:
        x = b.duplicate()
        x.set(0.0)
        try:
            ksp.solve(b, x)
        except PETSc.Error:
            return x, np.inf
        self._spent["linear_iterations"] += ksp.getIterationNumber()
        residual = self._left(x, b).norm() / size
        return x, float(residual) if np.isfinite(residual) else np.inf

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


class Rows:
    """Which rows of PETSc's system the unknowns of a stage are on a rank.

    The system's rows follow one another by rank: displacements by node, pressures, and on the first rank as many rows
    as make whole blocks of the motions of rigid bodies.
    """

    def __init__(self, comm: MPI.Comm, constraints: Constraints, space: Space) -> None:
        self._comm, self._space, self._constraints = comm, space, constraints
        ncomp, nbody = len(space.components), constraints.ties.shape[1]
        own = np.flatnonzero(np.ones(space.ndof, bool)[space.counted]) if isinstance(space.counted, slice) else (
            np.flatnonzero(space.counted)
        )  # fmt: skip
        extra = -(-nbody // ncomp) * ncomp if comm.rank == 0 else 0
        self.nown = len(own) + extra
        self.first = comm.exscan(self.nown) or 0
        number = np.zeros(space.ndof)
        number[own] = self.first + np.arange(len(own))
        dofs = space.summed(number).astype(PETSc.IntType)
        bodies = comm.bcast(self.first + len(own)) + np.arange(nbody)
        unknown = np.concatenate([dofs[constraints.free], bodies])
        held = np.setdiff1d(own, constraints.free)
        spare = self.first + len(own) + np.arange(nbody if comm.rank == 0 else 0, extra)
        self._number = np.concatenate([unknown, dofs[held], spare]).astype(PETSc.IntType)
        self._unknown, self._nheld = unknown, len(held) + len(spare)
        self._mine = (unknown >= self.first) & (unknown < self.first + self.nown)
        self._map = PETSc.LGMap().create(self._number, comm=comm)
        self._ghosted: PETSc.Vec | None = None
        self._own = own

    def matrix(self, share: csr_matrix, old: PETSc.Mat | None) -> PETSc.Mat:
        """Return the sum of the ranks' shares of a matrix on the unknowns, in `old` where that is given."""
        size = self._comm.allreduce(float(np.abs(share.diagonal()).max(initial=0.0)), MPI.MAX)
        n, more = share.shape[0], np.arange(1, self._nheld + 1)
        indptr = np.concatenate([share.indptr, share.indptr[-1] + more]).astype(PETSc.IntType)
        indices = np.concatenate([share.indices, n - 1 + more]).astype(PETSc.IntType)
        values = np.concatenate([share.data, np.full(self._nheld, size or 1.0)])
        if old is None:
            return self._made(indptr, indices, values)
        old.zeroEntries()
        old.setValuesLocalCSR(indptr, indices, values, addv=PETSc.InsertMode.ADD_VALUES)
        old.assemble()
        return old

    def _made(self, indptr: np.ndarray, indices: np.ndarray, values: np.ndarray) -> PETSc.Mat:
        """Return a new matrix whose pattern PETSc finds from the ranks' shares."""
        n = len(self._number)
        local = PETSc.Mat().createAIJ((n, n), csr=(indptr, indices, values), comm=PETSc.COMM_SELF)
        size = (self.nown, None)
        shares = PETSc.Mat().createIS((size, size), self._map, self._map, comm=self._comm)
        shares.setISLocalMat(local)
        shares.assemble()
        matrix = PETSc.Mat()
        shares.convert("aij", matrix)
        matrix.setLGMap(self._map, self._map)
        shares.destroy()
        local.destroy()
        return matrix

    def vector(self, unknowns: np.ndarray) -> PETSc.Vec:
        """Return PETSc's vector of values at the unknowns, zero in the other rows."""
        vector = PETSc.Vec().createMPI((self.nown, None), comm=self._comm)
        values = np.zeros(self.nown)
        values[self._unknown[self._mine] - self.first] = unknowns[self._mine]
        vector.array[:] = values
        return vector

    def unknowns(self, vector: PETSc.Vec) -> np.ndarray:
        """Return the values (n,) of PETSc's vector at the unknowns, those of other ranks too."""
        ghosts = self._unknown[~self._mine].astype(PETSc.IntType)
        if self._ghosted is None:
            self._ghosted = PETSc.Vec().createGhost(ghosts, (self.nown, None), comm=self._comm)
        vector.copy(self._ghosted)
        self._ghosted.ghostUpdate(PETSc.InsertMode.INSERT_VALUES, PETSc.ScatterMode.FORWARD)
        found = np.empty(len(self._unknown))
        with self._ghosted.localForm() as local:
            found[self._mine] = local.array[self._unknown[self._mine] - self.first]
            found[~self._mine] = local.array[self.nown :]
        return found

    def tell_motions(self, matrix: PETSc.Mat) -> None:
        """Tell a matrix its blocks and the rigid motions of its free displacements."""
        space = self._space
        if isinstance(space, PorousSpace):
            return
        matrix.setBlockSize(len(space.components))
        matrix.setNearNullSpace(PETSc.NullSpace().create(vectors=self._motions(len(self._own)), comm=self._comm))

    def fields(self, matrix: PETSc.Mat) -> tuple[tuple[str, PETSc.IS], tuple[str, PETSc.IS]]:
        """Return the rows of the displacements and those of the pressures, by name."""
        assert isinstance(self._space, PorousSpace)
        rows, wet = self.first + np.arange(self.nown), np.zeros(self.nown, bool)
        wet[: len(self._own)] = self._own >= self._space.nmotion
        fields = [PETSc.IS().createGeneral(rows[part].astype(PETSc.IntType), comm=self._comm) for part in (~wet, wet)]
        fields[0].setBlockSize(len(self._space.components))
        near = PETSc.NullSpace().create(vectors=self._motions(int((~wet).sum()), compact=True), comm=self._comm)
        fields[0].compose("nearnullspace", near)
        return ("motion", fields[0]), ("pressure", fields[1])

    def _motions(self, n: int, compact: bool = False) -> list[PETSc.Vec]:
        """Return the rigid motions of the free displacements as orthonormal vectors."""
        space, ncomp = self._space, len(self._space.components)
        ranks, points = space.mesh.ranks, space.mesh.points
        low, high = ranks.least(points.min(axis=0)), ranks.largest(points.max(axis=0))
        centred = (points - 0.5 * (low + high) * (not space.kinematics.radial)) / float((high - low).max())
        modes = space.kinematics.modes(centred).reshape(-1, len(points) * ncomp)
        held = np.setdiff1d(np.arange(modes.shape[1]), self._constraints.free)
        modes[:, held] = 0.0
        mine = self._own[self._own < modes.shape[1]]
        size = n if compact else self.nown
        found: list[PETSc.Vec] = []
        for mode in modes:
            vector = PETSc.Vec().createMPI((size, None), comm=self._comm)
            values = np.zeros(size)
            values[: len(mine)] = mode[mine]
            vector.array[:] = values
            for other in found:
                vector.axpy(-vector.dot(other), other)
            if vector.normalize() > 1e-12:
                found.append(vector)
        return found
