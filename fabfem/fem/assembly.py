"""The stiffness matrix on a sparsity pattern that is found once.

Entries never leave the pattern, whatever the points do, so that a linear solver may keep its analysis. The tangent may
be unsymmetric. The element matrix is BᵀCB over the strain components that the kinematics can make non-zero.
"""

from dataclasses import dataclass

import numba
import numpy as np
from scipy.sparse import csr_matrix

from fabfem.fem.space import Space


@dataclass(frozen=True)
class Pattern:
    """Fixed sparsity: CSR arrays, and where in `data` each entry of each element's matrix belongs."""

    indptr: np.ndarray
    indices: np.ndarray
    dofs: np.ndarray
    """(nel, m) rows of each element's matrix."""
    offsets: np.ndarray
    """(nel, m, m) place of each entry in its row, in two bytes where that is enough."""

    @property
    def positions(self) -> np.ndarray:
        """(nel, m, m) place of each entry in `data`."""
        return self.indptr[self.dofs][:, :, None] + self.offsets

    def matrix(self, data: np.ndarray) -> csr_matrix:
        """A matrix of this pattern that shares its index arrays."""
        n = len(self.indptr) - 1
        return csr_matrix((data, self.indices, self.indptr), shape=(n, n), copy=False)


def find_pattern(dofs: np.ndarray, ndof: int) -> Pattern:
    """The pattern that element matrices on `dofs` (nel, m) fill."""
    nel, m = dofs.shape
    incidence = csr_matrix((np.ones(dofs.size, np.int8), dofs.ravel(), np.arange(0, dofs.size + 1, m)), (nel, ndof))
    graph = (incidence.T.astype(bool) @ incidence.astype(bool)).tocsr()
    graph.sort_indices()
    indptr, indices = graph.indptr.astype(np.int32), graph.indices.astype(np.int32)
    longest = int(np.diff(indptr).max(initial=0))
    offsets = np.empty((nel, m, m), np.uint16 if longest <= np.iinfo(np.uint16).max else np.int32)
    _fill_offsets(offsets, dofs, indptr, indices)
    return Pattern(indptr, indices, dofs, offsets)


def stiffness(space: Space, pattern: Pattern, tangent: np.ndarray) -> csr_matrix:
    """(ndof, ndof) stiffness of the tangents (npoints, 6, 6)."""
    data = np.zeros(len(pattern.indices))
    operator = (space.kinematics.active, *space.kinematics.sparse_operator)
    _stiffness(data, tangent, space.weights, space.terms, pattern.indptr, pattern.dofs, pattern.offsets, *operator)
    return pattern.matrix(data)


@numba.njit(cache=True, nogil=True)
def _fill_offsets(offsets, dofs, indptr, indices):
    nel, m = dofs.shape
    for e in range(nel):
        for i in range(m):
            row = indices[indptr[dofs[e, i]] : indptr[dofs[e, i] + 1]]
            for j in range(m):
                offsets[e, i, j] = np.searchsorted(row, dofs[e, j])


@numba.njit(cache=True, nogil=True)
def _stiffness(data, tangent, weights, terms, indptr, dofs, offsets, active, where, values):
    nel, nq = terms.shape[:2]
    m, nactive = dofs.shape[1], len(active)
    b, cb, local = np.empty((nactive, m)), np.empty((nactive, m)), np.empty((m, m))
    for e in range(nel):
        local[:] = 0.0
        for q in range(nq):
            p = e * nq + q
            _fill(b, terms[e, q], where, values)
            _contract(cb, tangent[p], b, active, weights[p])
            _add_product(local, b, cb)
        for i in range(m):
            first = indptr[dofs[e, i]]
            for j in range(m):
                data[first + offsets[e, i, j]] += local[i, j]


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
