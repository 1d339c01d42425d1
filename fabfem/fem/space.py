"""The discrete space: shape terms, weights, dofs, and the strain operator with its transpose.

Points are numbered element by element, dofs node by node (dof = node * ncomp + component). A space knows only its own
mesh, so the part of a mesh that one rank owns makes a space like any other.
"""

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np

from fabfem.fem.elements import ELEMENTS, quadrature, shape
from fabfem.fem.kinematics import Kinematics
from fabfem.fem.mesh import Mesh
from fabfem.fem.patches import patches, widened


@dataclass(frozen=True)
class Space:
    """Displacement on a mesh, seen from nodes and from points.

    Attributes
    ----------
    mesh : Mesh
    kinematics : Kinematics
    dofs : (nel, nnode*ncomp) int32 array
        Those that an element's strain depends on; with a mean dilation those of its whole patch, the element's first.
    values : (nq, nnode) array
        Shape functions at the points of the reference element.
    terms : (nel, nq, nnode, nterm) array
        Shape terms: derivatives along the mesh axes, then N/r where there is an axis; with a mean dilation followed by
        their means over the patch.
    weights : (npoints,) array
        Volume of each point, per unit thickness in plane strain, all around the axis in axisymmetry.
    points : (npoints, dim) array
        Where the points are.
    where : (nq, dim) array
        The same on the reference element.
    """

    mesh: Mesh
    kinematics: Kinematics
    dofs: np.ndarray
    values: np.ndarray
    terms: np.ndarray
    weights: np.ndarray
    points: np.ndarray
    where: np.ndarray

    @property
    def nq(self) -> int:
        """Points per element."""
        return len(self.values)

    @property
    def npoints(self) -> int:
        """Points in all."""
        return len(self.weights)

    @property
    def ndof(self) -> int:
        """Unknowns, fixed ones included."""
        return len(self.mesh.points) * len(self.components)

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the displacement components."""
        return self.kinematics.components

    def component(self, name: str) -> int:
        """Number of a displacement component; raises ValueError with the names that exist."""
        if name not in self.components:
            raise ValueError(f"there is no displacement component '{name}'; there are {', '.join(self.components)}.")
        return self.components.index(name)

    def dofs_on(self, boundary: str, component: str) -> np.ndarray:
        """Dofs of one component on a boundary, each once."""
        return self.mesh.nodes_on(boundary) * len(self.components) + self.component(component)

    def points_of(self, elements: np.ndarray) -> slice | np.ndarray:
        """The points of some elements, as a slice where they follow one another."""
        if not len(elements):
            return slice(0, 0)
        first, last = int(elements[0]), int(elements[-1]) + 1
        if len(elements) == last - first and (np.diff(elements) == 1).all():
            return slice(first * self.nq, last * self.nq)
        return (elements[:, None] * self.nq + np.arange(self.nq)).ravel()

    def strain(self, displacement: np.ndarray) -> np.ndarray:
        """(npoints, 6) Mandel strain, compression positive, of a displacement (ndof,)."""
        strain = np.zeros((self.npoints, 6))
        _strain(strain, displacement, self.dofs, self.terms, self.kinematics.active, *self.kinematics.sparse_operator)
        return strain

    def internal_force(self, stress: np.ndarray) -> np.ndarray:
        """(ndof,) nodal forces in equilibrium with a stress (npoints, 6)."""
        force = np.zeros(self.ndof)
        operator = (self.kinematics.active, *self.kinematics.sparse_operator)
        _force(force, stress, self.weights, self.dofs, self.terms, *operator)
        return self.summed(force)

    def summed(self, force: np.ndarray) -> np.ndarray:
        """(ndof,) nodal forces with what the elements of other ranks add to them."""
        return self.mesh.ranks.summed(force.reshape(len(self.mesh.points), -1)).ravel()

    @cached_property
    def counted(self) -> np.ndarray | slice:
        """Which dofs this rank counts: all, or those of the nodes that it owns."""
        owned = self.mesh.ranks.owned(np.arange(len(self.mesh.points)))
        return owned if isinstance(owned, slice) else np.repeat(owned, len(self.components))

    def dot(self, a: np.ndarray, b: np.ndarray) -> float:
        """The product of two vectors of all dofs, or of the displacements, each dof counted once."""
        counted = self.counted if isinstance(self.counted, slice) else self.counted[: len(a)]
        return self.mesh.ranks.sum(float((a * b)[counted].sum()))

    def norm(self, a: np.ndarray) -> float:
        """The length of a vector of all dofs, or of the displacements, each dof counted once."""
        return float(np.sqrt(self.dot(a, a)))

    def total(self, values: np.ndarray, dofs: np.ndarray) -> float:
        """The sum of values (ndof,) over some dofs, each counted once."""
        return self.mesh.ranks.sum(float(values[self.once(dofs)].sum()))

    def nodal_sum(self, values: np.ndarray, nodes: np.ndarray) -> float:
        """The sum of values (n,) at some nodes (n,), each counted once."""
        return self.mesh.ranks.sum(float(values[self.mesh.ranks.owned(nodes)].sum()))

    def nodal_mean(self, values: np.ndarray, nodes: np.ndarray) -> float:
        """The mean of values (n,) at some nodes (n,), each counted once."""
        return self.nodal_sum(values, nodes) / self.nodal_sum(np.ones(len(nodes)), nodes)

    def volume_mean(self, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """The mean (...) of values (n, ...) at points, weighted with their volumes (n,)."""
        ranks = self.mesh.ranks
        return ranks.sum(np.tensordot(weights, values, 1)) / ranks.sum(float(weights.sum()))

    def once(self, dofs: np.ndarray) -> np.ndarray:
        """Those of some dofs that this rank counts."""
        return dofs if isinstance(self.counted, slice) else dofs[self.counted[dofs]]

    def displacement(self, u: np.ndarray) -> np.ndarray:
        """(nnodes, 3) displacement along the three axes of the kinematics."""
        full = np.zeros((len(self.mesh.points), 3))
        full[:, self.kinematics.axes] = u.reshape(len(full), -1)
        return full

    def farthest(self, u: np.ndarray) -> float:
        """Length of the largest displacement of a node, of all ranks."""
        return self.mesh.ranks.largest(float(np.linalg.norm(self.displacement(u), axis=1).max()))

    def at_rest(self, u: np.ndarray) -> np.ndarray:
        """The unknowns with the displacement set to zero."""
        return np.zeros_like(u)

    def cell_mean(self, values: np.ndarray) -> np.ndarray:
        """(nel, ...) volume means of point values (npoints, ...)."""
        weights = self.weights.reshape(-1, self.nq)
        grouped = values.reshape(*weights.shape, *values.shape[1:])
        return np.einsum("eq...,eq->e...", grouped, weights / weights.sum(axis=1, keepdims=True))

    def nodal(self, values: np.ndarray) -> np.ndarray:
        """(nnodes, ...) smoothed values: a linear fit in each element, then the volume-weighted mean at each node."""
        cells = self.mesh.cells
        volume = self.weights.reshape(-1, self.nq).sum(axis=1)
        fitted = np.einsum("aq,eqk->eak", self._to_nodes, values.reshape(len(cells), self.nq, -1))
        total = np.zeros((len(self.mesh.points), fitted.shape[2]))
        share = np.bincount(cells.ravel(), np.repeat(volume, cells.shape[1]), len(total))
        for k in range(total.shape[1]):
            total[:, k] = np.bincount(cells.ravel(), (fitted[:, :, k] * volume[:, None]).ravel(), len(total))
        ranks = self.mesh.ranks
        total = ranks.summed(total) / ranks.summed(share[:, None])
        return total.reshape(len(total), *values.shape[1:])

    def nodal_within(self, values: np.ndarray) -> np.ndarray:
        """(nnodes,) smoothed values, none beyond the range of the points in the elements around the node.

        A linear fit reaches beyond the points: near a footing's edge a mean stress becomes negative, a void ratio huge.
        """
        cells, by_cell = self.mesh.cells, values.reshape(-1, self.nq)
        least, most = np.full(len(self.mesh.points), np.inf), np.full(len(self.mesh.points), -np.inf)
        np.minimum.at(least, cells, by_cell.min(axis=1)[:, None])
        np.maximum.at(most, cells, by_cell.max(axis=1)[:, None])
        ranks = self.mesh.ranks
        return np.clip(self.nodal(values), -ranks.extreme(-least), ranks.extreme(most))

    @cached_property
    def _to_nodes(self) -> np.ndarray:
        """(nnode, nq) least-squares fit of the linear element's functions to the points, evaluated at the nodes."""
        element = self.mesh.element
        linear = ELEMENTS[element.linear or element.name]
        return shape(linear, element.nodes)[0] @ np.linalg.pinv(shape(linear, self.where)[0])


def build_space(mesh: Mesh, kinematics: Kinematics, points: int | None = None) -> Space:
    """The space of `kinematics` on `mesh` with `points` points per element, by default the element's usual number.

    Raises ValueError where mesh and kinematics do not fit together.
    """
    if mesh.dim != kinematics.dim:
        raise ValueError(f"this kinematics needs a mesh of dimension {kinematics.dim}, the mesh has {mesh.dim}.")
    where, rule = quadrature(mesh.element, points)
    values, reference = shape(mesh.element, where)
    nodes = mesh.points[mesh.cells]
    jacobian = np.einsum("eai,qaj->eqij", nodes, reference)
    terms = np.einsum("qaj,eqji->eqai", reference, np.linalg.inv(jacobian))
    weights = np.linalg.det(jacobian) * rule
    places = np.einsum("qa,eai->eqi", values, nodes)
    if kinematics.radial:
        radius = _radius(places)
        terms = np.concatenate([terms, (values / radius[:, :, None])[..., None]], axis=3)
        weights = weights * 2.0 * np.pi * radius
    supporting = mesh.cells
    if kinematics.mean_dilation:
        supporting, terms = _with_means(mesh, terms, weights)
    return Space(
        *(mesh, kinematics, _dofs(supporting, len(kinematics.components)), values, np.ascontiguousarray(terms)),
        *(weights.ravel(), places.reshape(-1, mesh.dim), where),
    )


def _with_means(mesh: Mesh, terms: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The nodes of each element's patch, and the terms (nel, nq, nnode, nterm) there followed by their patch means."""
    own = np.einsum("eqat,eq->eat", terms, weights)
    nodes, means = widened(mesh.cells, patches(mesh), own, weights.sum(axis=1))
    wide = np.zeros((*terms.shape[:2], nodes.shape[1], 2 * terms.shape[3]))
    wide[:, :, : terms.shape[2], : terms.shape[3]] = terms
    wide[..., terms.shape[3] :] = means[:, None]
    return nodes, wide


def _radius(places: np.ndarray) -> np.ndarray:
    if places[..., 0].min() <= 0.0:
        raise ValueError("an axisymmetric mesh must lie at x > 0: x is the radius.")
    return places[..., 0]


def _dofs(cells: np.ndarray, ncomp: int) -> np.ndarray:
    """(nel, nnode*ncomp) dofs of each element, node by node."""
    return (cells[:, :, None] * ncomp + np.arange(ncomp)).reshape(len(cells), -1).astype(np.int32)


@numba.njit(cache=True, nogil=True)
def _strain(strain, u, dofs, terms, active, where, values):
    nel, nq, nnode, _ = terms.shape
    ncomp = dofs.shape[1] // nnode
    for e in range(nel):
        for q in range(nq):
            for k in range(len(values)):
                row, component, term = active[where[k, 0]], where[k, 1], where[k, 2]
                total = 0.0
                for a in range(nnode):
                    total += terms[e, q, a, term] * u[dofs[e, a * ncomp + component]]
                strain[e * nq + q, row] += values[k] * total


@numba.njit(cache=True, nogil=True)
def _force(force, stress, weights, dofs, terms, active, where, values):
    nel, nq, nnode, _ = terms.shape
    ncomp = dofs.shape[1] // nnode
    local = np.empty(dofs.shape[1])
    for e in range(nel):
        local[:] = 0.0
        for q in range(nq):
            p = e * nq + q
            for k in range(len(values)):
                component, term = where[k, 1], where[k, 2]
                flow = values[k] * weights[p] * stress[p, active[where[k, 0]]]
                for a in range(nnode):
                    local[a * ncomp + component] += flow * terms[e, q, a, term]
        for i in range(len(local)):
            force[dofs[e, i]] += local[i]
