"""The stiffness of the unknowns, Tᵀ K T, from that of all dofs: by an index array or a sparse sum."""

from dataclasses import dataclass

import numba
import numpy as np
from scipy.sparse import csr_matrix

from fabfem.fem.assembly import Pattern
from fabfem.fem.supports import Constraints


@dataclass(frozen=True)
class Reduction:
    """The matrix Tᵀ K T of a matrix K of known pattern, itself of one fixed pattern."""

    pattern: Pattern
    keep: np.ndarray
    """Whether each entry of K stays as it is, where nothing is tied."""
    gather: csr_matrix | None = None
    """(entries of Tᵀ K T, entries of K) how the one is summed from the other, where something is tied."""

    def __call__(self, matrix: csr_matrix) -> csr_matrix:
        """The reduced `matrix`."""
        if self.gather is not None:
            return self.pattern.matrix(self.gather @ matrix.data)
        return self.pattern.matrix(_kept(matrix.data, self.keep, len(self.pattern.indices)))


@numba.njit(cache=True, nogil=True)
def _kept(data, keep, count):
    """data[keep]; four times as fast as numpy does it."""
    kept = np.empty(count)
    k = 0
    for i in range(len(keep)):
        if keep[i]:
            kept[k] = data[i]
            k += 1
    return kept


def reduction(pattern: Pattern, constraints: Constraints) -> Reduction:
    """How to reduce matrices of `pattern`."""
    return _combined(pattern, constraints) if constraints.ties.shape[1] else _cut(pattern, constraints)


def _cut(pattern: Pattern, constraints: Constraints) -> Reduction:
    ndof = len(pattern.indptr) - 1
    number = np.full(ndof, -1, np.int32)
    number[constraints.free] = np.arange(len(constraints.free), dtype=np.int32)
    rows = np.repeat(number, np.diff(pattern.indptr))
    columns = number[pattern.indices]
    keep = (rows >= 0) & (columns >= 0)
    counts = np.bincount(rows[keep], minlength=len(constraints.free))
    indptr = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    return Reduction(_bare(indptr, columns[keep]), keep)


def _combined(pattern: Pattern, constraints: Constraints) -> Reduction:
    """The sum over all entries K_ij of T_ia T_jb, by entry (a, b)."""
    ndof, nfree = len(constraints.motion), len(constraints.free)
    row, column = np.nonzero(constraints.ties)
    n = nfree + constraints.ties.shape[1]
    i = np.concatenate([constraints.free, constraints.tied[row]])
    a = np.concatenate([np.arange(nfree), nfree + column])
    transfer = csr_matrix((np.concatenate([np.ones(nfree), constraints.ties[row, column]]), (i, a)), (ndof, n))
    entry_row = np.repeat(np.arange(ndof), np.diff(pattern.indptr))
    entry, left, first = _expanded(transfer, entry_row)
    again, right, second = _expanded(transfer, pattern.indices[entry])
    entry, key = entry[again], left[again].astype(np.int64) * n + right
    keys, place = np.unique(key, return_inverse=True)
    gather = csr_matrix((first[again] * second, (place, entry)), (len(keys), len(pattern.indices)))
    indptr = np.searchsorted(keys, np.arange(n + 1) * n).astype(np.int32)
    return Reduction(_bare(indptr, (keys % n).astype(np.int32)), np.zeros(0, bool), gather)


def _bare(indptr: np.ndarray, indices: np.ndarray) -> Pattern:
    """The pattern of a matrix that no element's matrix is put into."""
    return Pattern(indptr, indices, np.zeros((0, 0), np.int32), np.zeros((0, 0, 0), np.uint16))


def _expanded(transfer: csr_matrix, dofs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For a list of dofs, each entry of each one's row of T: place in the list, unknown, value."""
    counts = np.diff(transfer.indptr)[dofs]
    where = np.repeat(np.arange(len(dofs)), counts)
    begun = np.repeat(np.cumsum(counts) - counts, counts)
    entries = np.repeat(transfer.indptr[dofs], counts) + np.arange(counts.sum()) - begun
    return where, transfer.indices[entries], transfer.data[entries]
