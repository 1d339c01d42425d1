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
    """(nel, m, m) place of each entry in its row, in one byte where that is enough."""
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
    offsets = np.zeros((*rows.shape, rows.shape[1]), np.min_scalar_type(longest))
    _fill_offsets(offsets, rows, indptr, indices, triangle)
    return Pattern(indptr, indices, rows, offsets, triangle)


def stiffness(space: Space, pattern: Pattern, tangent: np.ndarray) -> csr_matrix:
    """(n, n) stiffness of the tangents (npoints, k, k) between active components, as much as the pattern has."""
    assert tangent.shape[1] == len(space.kinematics.active), "a tangent has the active components alone"
    data = np.zeros(len(pattern.indices))
    where = (pattern.indptr, pattern.rows, pattern.offsets, pattern.triangle)
    _stiffness(data, tangent, space.weights, space.terms, *where, *space.kinematics.sparse_operator)
    return pattern.matrix(data)


def diagonal(space: Space, tangent: np.ndarray) -> np.ndarray:
    """(ndof,) diagonal of the stiffness of all dofs, without the elements of other ranks."""
    found = np.zeros(space.ndof)
    _diagonal(found, tangent, space.weights, space.terms, space.dofs, *space.kinematics.sparse_operator)
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
def _diagonal(found, tangent, weights, terms, dofs, where, values):
    nel, nq = terms.shape[:2]
    nactive = tangent.shape[1]
    b, cb = np.empty((nactive, dofs.shape[1])), np.empty((nactive, dofs.shape[1]))
    for e in range(nel):
        for q in range(nq):
            _fill(b, terms[e, q], where, values)
            _contract(cb, tangent[e * nq + q], b, weights[e * nq + q])
            for i in range(b.shape[1]):
                for r in range(nactive):
                    found[dofs[e, i]] += b[r, i] * cb[r, i]


@numba.njit(cache=True, nogil=True)
def _stiffness(data, tangent, weights, terms, indptr, rows, offsets, triangle, where, values):
    nel, nq = terms.shape[:2]
    m, nactive = rows.shape[1], tangent.shape[1]
    b, cb, local = np.empty((nactive, m)), np.empty((nactive, m)), np.empty((m, m))
    for e in range(nel):
        local[:] = 0.0
        for q in range(nq):
            p = e * nq + q
            _fill(b, terms[e, q], where, values)
            _contract(cb, tangent[p], b, weights[p])
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
def _contract(cb, c, b, weight):
    """Set cb to weight * c @ b."""
    cb[:] = 0.0
    for r in range(len(c)):
        for s in range(len(c)):
            factor = weight * c[r, s]
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
