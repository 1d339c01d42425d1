"""The stiffness of the unknowns, Tᵀ K T.

Where no unknown is the motion of a rigid body and there is no water, elements are put into it directly, and the
stiffness of all dofs is never made; elsewhere it is summed from that by one sparse matrix.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

from fabfem.fem.assembly import Pattern, find_pattern, stiffness
from fabfem.fem.constraints import Constraints
from fabfem.fem.space import Space


@dataclass(frozen=True)
class Reduction:
    """What makes the stiffness of the unknowns of a stage, always of one pattern; found when it is first needed.

    Attributes
    ----------
    space : Space
    constraints : Constraints
    triangle : bool
        Whether the entries below the diagonal are left out.
    whole : Pattern or None
        That of the stiffness of all dofs, where it has to be made first.
    """

    space: Space
    constraints: Constraints
    triangle: bool = False
    whole: Pattern | None = None

    def stiffness(self, tangent: np.ndarray, wet: csr_matrix | None = None) -> csr_matrix:
        """The stiffness of the tangents (npoints, k, k), with what water adds to that of all dofs (`whole`)."""
        if self.whole is None:
            return stiffness(self.space, self._direct, tangent)
        matrix = stiffness(self.space, self.whole, tangent)
        if wet is not None:
            matrix.data += wet.data
        gather, pattern = self._summed
        return pattern.matrix(gather @ matrix.data)

    def same(self, other: "Reduction") -> bool:
        """Whether another makes the same of every tangent."""
        mine, its = self.constraints, other.constraints
        pairs = ((mine.free, its.free), (mine.tied, its.tied), (mine.ties, its.ties))
        alike = self.triangle == other.triangle and self.whole is other.whole
        return alike and all(np.array_equal(one, another) for one, another in pairs)

    @cached_property
    def _direct(self) -> Pattern:
        """The pattern that elements fill, of the unknowns."""
        number = np.full(self.space.ndof, -1, np.int32)
        number[self.constraints.free] = np.arange(len(self.constraints.free), dtype=np.int32)
        return find_pattern(number[self.space.dofs], len(self.constraints.free), self.triangle)

    @cached_property
    def _summed(self) -> tuple[csr_matrix, Pattern]:
        """(entries of Tᵀ K T, entries of K) the sum over all entries K_ij of T_ia T_jb, and the pattern of it."""
        assert self.whole is not None
        constraints, nfree = self.constraints, len(self.constraints.free)
        row, column = np.nonzero(constraints.ties)
        n = constraints.nunknowns
        i = np.concatenate([constraints.free, constraints.tied[row]])
        a = np.concatenate([np.arange(nfree), nfree + column])
        values = np.concatenate([np.ones(nfree), constraints.ties[row, column]])
        transfer = csr_matrix((values, (i, a)), (self.space.ndof, n))
        entry_row = np.repeat(np.arange(self.space.ndof), np.diff(self.whole.indptr))
        entry, left, first = _expanded(transfer, entry_row)
        again, right, second = _expanded(transfer, self.whole.indices[entry])
        entry, left, value = entry[again], left[again].astype(np.int64), first[again] * second
        if self.triangle:
            upper = right >= left
            entry, left, right, value = entry[upper], left[upper], right[upper], value[upper]
        keys, place = np.unique(left * n + right, return_inverse=True)
        gather = csr_matrix((value, (place, entry)), (len(keys), len(self.whole.indices)))
        indptr = np.searchsorted(keys, np.arange(n + 1) * n).astype(np.int32)
        return gather, _bare(indptr, (keys % n).astype(np.int32), self.triangle)


def _bare(indptr: np.ndarray, indices: np.ndarray, triangle: bool) -> Pattern:
    """The pattern of a matrix that no element's matrix is put into."""
    return Pattern(indptr, indices, np.zeros((0, 0), np.int32), np.zeros((0, 0, 0), np.uint8), triangle)


def _expanded(transfer: csr_matrix, dofs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For a list of dofs, each entry of each one's row of T: place in the list, unknown, value."""
    counts = np.diff(transfer.indptr)[dofs]
    where = np.repeat(np.arange(len(dofs)), counts)
    begun = np.repeat(np.cumsum(counts) - counts, counts)
    entries = np.repeat(transfer.indptr[dofs], counts) + np.arange(counts.sum()) - begun
    return where, transfer.indices[entries], transfer.data[entries]
