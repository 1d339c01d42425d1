"""The rows of PETSc's system that the unknowns of a stage are on a rank."""

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_matrix

from fabfem.fem.constraints import Constraints
from fabfem.fem.porous_space import PorousSpace
from fabfem.fem.space import Space


class Rows:
    """Where the unknowns of a stage are.

    The system's rows follow one another by rank: displacements by node, pressures, and on the first rank as many rows
    as make whole blocks of the motions of rigid bodies.
    """

    def __init__(self, comm: MPI.Comm, constraints: Constraints, space: Space) -> None:
        self._comm, self._space, self._constraints = comm, space, constraints
        ncomp, nbody = len(space.components), constraints.ties.shape[1]
        own = np.arange(space.ndof)[space.counted]
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
