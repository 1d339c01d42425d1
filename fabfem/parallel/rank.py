"""One rank among many: its part of the mesh, and sums over all ranks.

Nodes of the part are numbered owned ones first, then the ghosts, both in the order of the whole mesh. A vector of
PETSc with ghosts adds up what several ranks have at a node and hands the sum back, so that all have the same.
"""

import pickle
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from fabfem.fem.constraints import Constraints
from fabfem.fem.mesh import Mesh
from fabfem.fem.points import Refusal
from fabfem.fem.ranks import Alone, Around
from fabfem.fem.space import Space
from fabfem.parallel.halo import around
from fabfem.parallel.solver import PetscSolver, Settings


class Part(NamedTuple):
    """What a rank has of a mesh."""

    elements: np.ndarray
    """(nel,) numbers in the whole mesh."""
    nodes: np.ndarray
    """(nnodes,) numbers in the whole mesh, owned ones first."""
    nowned: int
    ghosts: np.ndarray
    """Numbers of the ghosts where each rank's owned nodes follow one another."""
    patches: np.ndarray
    """(nel,) patch of each element."""
    touching: dict[str, np.ndarray]
    """Nodes on each boundary whose facets there are all on other ranks."""
    told: str
    """Hash of the whole mesh."""


class Rank(Alone):
    """One of the processes that share a run."""

    def __init__(self, comm: MPI.Comm, part: Part, settings: Settings) -> None:
        self.comm, self.part, self.settings = comm, part, settings
        self.rank, self.size = comm.rank, comm.size
        self.patches = part.patches
        self.spent: dict[str, float] = {"solves": 0, "linear_iterations": 0, "direct_instead": 0, "exchanged": 0}
        self._vectors: dict[int, PETSc.Vec] = {}

    def __reduce__(self) -> str:
        """Refuse to be sent: a communicator is not."""
        raise TypeError("a rank cannot be sent to another process")

    def sum(self, value: Any) -> Any:
        """A number or array, summed over all ranks."""
        return self.comm.allreduce(value, MPI.SUM)

    def least(self, value: Any) -> Any:
        """A number or array, its least over all ranks."""
        return -self.largest(-value)

    def largest(self, value: Any) -> Any:
        """A number or array, its largest over all ranks."""
        if isinstance(value, np.ndarray):
            return np.max(self.comm.allgather(value), axis=0)
        return self.comm.allreduce(value, MPI.MAX)

    def stacked(self, rows: np.ndarray) -> np.ndarray:
        """The rows of all ranks, in the order of the ranks."""
        return np.concatenate(self.comm.allgather(rows))

    def agreed(self, answer: Any, nq: int, may_hold: float) -> Any:
        """The answer of the points, a refusal where any rank has one or more than a share `may_hold` are held."""
        refused, held, npoints = isinstance(answer, Refusal), getattr(answer, "held", 0), len(self.part.elements) * nq
        worst = (-np.inf, -1) if refused else (answer.worst_error, -self.point(answer.worst_point, nq))
        told = self.comm.allgather((refused, held, npoints, worst))
        sinners = [rank for rank, (bad, *_) in enumerate(told) if bad]
        if sinners:
            mine = _sendable(answer._replace(point=self.point(answer.point, nq))) if refused else None
            return self.comm.bcast(mine, sinners[0])
        held, npoints = (sum(row[k] for row in told) for k in (1, 2))
        if held > may_hold * npoints:
            return Refusal(f"{held} of {npoints} points are refused by their material")
        error, point = max(row[3] for row in told)
        return answer._replace(worst_error=error, worst_point=-point, held=held)

    def summed(self, values: np.ndarray) -> np.ndarray:
        """(nnodes, k) values at nodes, summed over the ranks that have the node."""
        return self._exchanged(values, PETSc.InsertMode.ADD_VALUES)

    def extreme(self, values: np.ndarray) -> np.ndarray:
        """(nnodes,) values at nodes, the largest over the ranks that have the node."""
        return self._exchanged(values[:, None], PETSc.InsertMode.MAX_VALUES)[:, 0]

    def owned(self, nodes: np.ndarray) -> np.ndarray | slice:
        """Which of some nodes this rank counts."""
        return nodes < self.part.nowned

    def touching(self, boundary: str) -> np.ndarray:
        """Nodes of a boundary whose facets there are all on other ranks."""
        return self.part.touching[boundary]

    def told(self) -> str:
        """The hash of the whole mesh, where this is a part; empty where it is not."""
        return self.part.told

    def numbers(self, nel: int, nnodes: int) -> tuple[np.ndarray, np.ndarray]:
        """The numbers in the whole mesh of this rank's elements and nodes."""
        return self.part.elements, self.part.nodes

    def point(self, number: int, nq: int) -> int:
        """The number in the whole mesh of a point of this rank, `nq` points to an element; negative ones stay."""
        return number if number < 0 else int(self.part.elements[number // nq]) * nq + number % nq

    def places(self, points: np.ndarray, numbers: np.ndarray | list[int], nq: int) -> np.ndarray:
        """The places (n, dim) of points of the whole mesh, of which `points` are this rank's."""
        elements, within = np.divmod(np.asarray(numbers), nq)
        mine = np.searchsorted(self.part.elements, elements).clip(max=len(self.part.elements) - 1)
        there = self.part.elements[mine] == elements
        return self.sum(points[mine * nq + within] * there[:, None])

    def one(self, found: list[Any]) -> Any:
        """The first of what the ranks have found, of lists that may be empty on some of them."""
        return next(entry for entries in self.comm.allgather(found) for entry in entries)

    def nearest(self, distance: np.ndarray) -> np.ndarray:
        """The node of the least distance, the first in the whole mesh; empty on a rank that does not have it."""
        least = self.least(float(distance.min()))  # the same number at a node on all ranks that have it
        number = int(self.part.nodes[distance == least].min(initial=np.iinfo(np.int64).max))
        return np.flatnonzero(self.part.nodes == self.least(number))

    def around(self, mesh: Mesh, layers: int) -> Around:
        """A rank's mesh with some layers of the others' elements around it."""
        return around(self.comm, mesh, self.part.elements, self.part.nodes, layers)

    def solver(self, constraints: Constraints, space: Space) -> PetscSolver:
        """A linear solver for the unknowns of a stage."""
        return PetscSolver(self.comm, constraints, space, self.settings, self.spent)

    def _exchanged(self, values: np.ndarray, how: PETSc.InsertMode) -> np.ndarray:
        vector = self._vector(values.shape[1])
        self.spent["exchanged"] += 16 * values[self.part.nowned :].size  # [bytes], there and back
        with vector.localForm() as local:
            local.array[:] = values.ravel()
        vector.ghostUpdate(how, PETSc.ScatterMode.REVERSE)
        vector.ghostUpdate(PETSc.InsertMode.INSERT_VALUES, PETSc.ScatterMode.FORWARD)
        with vector.localForm() as local:
            return local.array.reshape(values.shape).copy()

    def _vector(self, width: int) -> PETSc.Vec:
        if width not in self._vectors:
            ghosts = self.part.ghosts.astype(PETSc.IntType)
            size = (self.part.nowned * width, None)
            self._vectors[width] = PETSc.Vec().createGhost(ghosts, size, bsize=width, comm=self.comm)
        return self._vectors[width]


def _sendable(refusal: Refusal) -> Refusal:
    """Return a refusal without the point alone where that cannot be sent, as a compiled routine cannot."""
    try:
        pickle.dumps(refusal)
    except (pickle.PicklingError, TypeError, AttributeError, ValueError):
        return refusal._replace(refused=None)
    return refusal
