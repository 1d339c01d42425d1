"""The stiffness matrix on a sparsity pattern that is found once.

Entries never leave the pattern, whatever the points do, so that a linear solver may keep its analysis. The tangent may
be unsymmetric. The element matrix is BᵀCB over the strain components that the kinematics can make non-zero. What of it
nobody needs, rows that are no unknowns or a lower triangle, is left out of the pattern.
"""

from dataclasses import dataclass

import numba
import numpy as np
from scipy.sparse import csr_matrix, triu

from fabfem.fem.space import Space


@dataclass(frozen=True)
class Pattern:
    """Fixed sparsity: CSR arrays, and where in `data` each entry of each element's matrix belongs."""

    indptr: np.ndarray
    indices: np.ndarray
    rows: np.ndarray
    """(nel, m) rows of each element's matrix, negative where they are left out."""
    offsets: np.ndarray
    """(nel, m, m) place of each entry in its row, in two bytes where that is enough."""
    triangle: bool = False
    """Whether entries below the diagonal are left out."""

    @property
    def positions(self) -> np.ndarray:
        """(nel, m, m) place of each entry in `data`, where nothing is left out."""
        return self.indptr[self.rows][:, :, None] + self.offsets

    def matrix(self, data: np.ndarray) -> csr_matrix:
        """A matrix of this pattern that shares its index arrays."""
        n = len(self.indptr) - 1
        return csr_matrix((data, self.indices, self.indptr), shape=(n, n), copy=False)


def find_pattern(rows: np.ndarray, n: int, triangle: bool = False) -> Pattern:
    """The (n, n) pattern that element matrices on `rows` (nel, m) fill, of negative ones nothing."""
    there = rows >= 0
    starts = np.concatenate([[0], np.cumsum(there.sum(axis=1))])
    incidence = csr_matrix((np.ones(starts[-1], bool), rows[there], starts), (len(rows), n))
    graph = csr_matrix(incidence.T @ incidence)
    graph = triu(graph, format="csr") if triangle else graph
    graph.sort_indices()
    indptr, indices = graph.indptr.astype(np.int32), graph.indices.astype(np.int32)
    longest = int(np.diff(indptr).max(initial=0))
    wide = np.uint16 if longest <= np.iinfo(np.uint16).max else np.int32
    offsets = np.zeros((*rows.shape, rows.shape[1]), wide)
    _fill_offsets(offsets, rows, indptr, indices, triangle)
    return Pattern(indptr, indices, rows, offsets, triangle)


def stiffness(space: Space, pattern: Pattern, tangent: np.ndarray) -> csr_matrix:
    """(n, n) stiffness of the tangents (npoints, 6, 6), as much of it as the pattern has."""
    data = np.zeros(len(pattern.indices))
    where = (pattern.indptr, pattern.rows, pattern.offsets, pattern.triangle)
    operator = (space.kinematics.active, *space.kinematics.sparse_operator)
    _stiffness(data, tangent, space.weights, space.terms, *where, *operator)
    return pattern.matrix(data)


def diagonal(space: Space, tangent: np.ndarray) -> np.ndarray:
    """(ndof,) diagonal of the stiffness of all dofs, without the elements of other ranks."""
    found = np.zeros(space.ndof)
    operator = (space.kinematics.active, *space.kinematics.sparse_operator)
    _diagonal(found, tangent, space.weights, space.terms, space.dofs, *operator)
    return found


@numba.njit(cache=True, nogil=True)
def _fill_offsets(offsets, rows, indptr, indices, triangle):
    nel, m = rows.shape
    for e in range(nel):
        for i in range(m):
            if rows[e, i] >= 0:
                row = indices[indptr[rows[e, i]] : indptr[rows[e, i] + 1]]
                first = rows[e, i] if triangle else 0
                for j in range(m):
                    if rows[e, j] >= first:
                        offsets[e, i, j] = np.searchsorted(row, rows[e, j])


@numba.njit(cache=True, nogil=True)
def _diagonal(found, tangent, weights, terms, dofs, active, where, values):
    nel, nq = terms.shape[:2]
    b, cb = np.empty((len(active), dofs.shape[1])), np.empty((len(active), dofs.shape[1]))
    for e in range(nel):
        for q in range(nq):
            _fill(b, terms[e, q], where, values)
            _contract(cb, tangent[e * nq + q], b, active, weights[e * nq + q])
            for i in range(b.shape[1]):
                for r in range(len(active)):
                    found[dofs[e, i]] += b[r, i] * cb[r, i]


@numba.njit(cache=True, nogil=True)
def _stiffness(data, tangent, weights, terms, indptr, rows, offsets, triangle, active, where, values):
    nel, nq = terms.shape[:2]
    m, nactive = rows.shape[1], len(active)
    b, cb, local = np.empty((nactive, m)), np.empty((nactive, m)), np.empty((m, m))
    for e in range(nel):
        local[:] = 0.0
        for q in range(nq):
            p = e * nq + q
            _fill(b, terms[e, q], where, values)
            _contract(cb, tangent[p], b, active, weights[p])
            _add_product(local, b, cb)
        for i in range(m):
            if rows[e, i] >= 0:
                begin, first = indptr[rows[e, i]], rows[e, i] if triangle else 0
                for j in range(m):
                    if rows[e, j] >= first:
                        data[begin + offsets[e, i, j]] += local[i, j]


@numba.njit(cache=True, nogil=True)
def _fill(matrix, terms, where, values):
    """Set `matrix` (nactive, nnode*ncomp) to the strain operator of a point with shape terms (nnode, nterm)."""
    ncomp = matrix.shape[1] // terms.shape[0]
    matrix[:] = 0.0
    for k in range(len(values)):
        row, component, term = where[k, 0], where[k, 1], where[k, 2]
        for a in range(terms.shape[0]):
            matrix[row, a * ncomp + component] += values[k] * terms[a, term]


@numba.njit(cache=True, nogil=True)
def _contract(cb, c, b, active, weight):
    """Set cb to weight * c[active, active] @ b."""
    cb[:] = 0.0
    for r in range(len(active)):
        for s in range(len(active)):
            factor = weight * c[active[r], active[s]]
            for j in range(b.shape[1]):
                cb[r, j] += factor * b[s, j]


@numba.njit(cache=True, nogil=True)
def _add_product(local, b, cb):
    """Add bᵀ @ cb to `local`; most entries of b are zero."""
    for r in range(b.shape[0]):
        for i in range(b.shape[1]):
            factor = b[r, i]
            if factor != 0.0:
                for j in range(b.shape[1]):
                    local[i, j] += factor * cb[r, j]
