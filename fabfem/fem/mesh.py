"""Meshes with named zones and boundaries: a zone is a set of elements, a boundary a set of facets."""

from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np

from fabfem.fem.elements import ELEMENTS, ElementType, quadrature, shape
from fabfem.fem.facets import MeshError, corners_of, distinct, facets_of, matching
from fabfem.fem.ranks import ALONE, Alone


@dataclass(frozen=True)
class Mesh:
    """Elements of one kind with named parts.

    Attributes
    ----------
    points : (nnodes, dim) array
        Node coordinates.
    cells : (nel, nnode) int array
        Nodes of each element in meshio's order.
    cell_type : str
        meshio's name of the element, a key of ``ELEMENTS``.
    zones : dict
        Name -> element numbers.
    boundaries : dict
        Name -> (nfacet, nfacetnode) nodes, turned so that the right-hand normal points out of the element.
    ranks : Alone
        Who has the other parts of the mesh, where this is one of several.
    """

    points: np.ndarray
    cells: np.ndarray
    cell_type: str
    zones: dict[str, np.ndarray]
    boundaries: dict[str, np.ndarray]
    ranks: Alone = ALONE

    @property
    def dim(self) -> int:
        """Dimension of the space and of the elements."""
        return self.points.shape[1]

    @property
    def element(self) -> ElementType:
        """The element's row in the table."""
        return ELEMENTS[self.cell_type]

    def zone(self, name: str) -> np.ndarray:
        """Element numbers of a zone; raises MeshError with the names that exist."""
        return _named(self.zones, name, "zone")

    def boundary(self, name: str) -> np.ndarray:
        """(nfacet, nfacetnode) nodes of a boundary; raises MeshError with the names that exist."""
        return _named(self.boundaries, name, "boundary")

    def nodes_on(self, name: str) -> np.ndarray:
        """The nodes of a boundary, each once; also those whose facets are all on other ranks."""
        return np.unique(np.concatenate([self.boundary(name).ravel(), self.ranks.touching(name)]))


def checked(mesh: Mesh) -> Mesh:
    """The same mesh; raises MeshError where elements are inverted or have no volume."""
    where, _ = quadrature(mesh.element)
    _, gradients = shape(mesh.element, where)
    jacobian = np.einsum("eai,qaj->eqij", mesh.points[mesh.cells], gradients)
    size = np.ptp(mesh.points[mesh.cells], axis=1).max(axis=1)
    bad = np.flatnonzero(np.linalg.det(jacobian).min(axis=1) <= 1e-10 * size**mesh.dim)
    if len(bad):
        some = ", ".join(map(str, bad[:8])) + (" …" if len(bad) > 8 else "")
        raise MeshError(f"{len(bad)} of {len(mesh.cells)} elements are inverted or have no volume: {some}.")
    return mesh


def quadratic(mesh: Mesh, cell_type: str = "") -> Mesh:
    """The same linear mesh with further nodes, those of `cell_type` or of the element's usual quadratic one."""
    new = ELEMENTS[cell_type or mesh.element.quadratic]
    points, cells = mesh.points, mesh.cells
    for width in sorted({len(m) for m in new.midside}):
        parents = mesh.cells[:, np.array([m for m in new.midside if len(m) == width])]
        parents = np.sort(parents.reshape(-1, width), axis=1)
        first, number = distinct(parents)
        cells = np.hstack([cells, len(points) + number.reshape(len(cells), -1)])
        points = np.vstack([points, mesh.points[parents[first]].mean(axis=1)])
    facets = facets_of(cells, new)
    boundaries = {name: matching(facets, b, new) for name, b in mesh.boundaries.items()}
    return replace(mesh, points=points, cells=cells, cell_type=new.name, boundaries=boundaries)


def owners(mesh: Mesh, facets: np.ndarray) -> np.ndarray:
    """(n,) an element that each of some facets (n, nfacetnode) of a mesh belongs to."""
    every = corners_of(facets_of(mesh.cells, mesh.element), mesh.element)
    first, key = distinct(np.vstack([every, corners_of(facets, mesh.element)]))
    return first[key[len(every) :]] // len(mesh.element.facets)


def _named(table: dict[str, np.ndarray], name: str, kind: str) -> np.ndarray:
    if name in table:
        return table[name]
    near = get_close_matches(name, table, n=1)
    hint = f", did you mean '{near[0]}'" if near else ""
    raise MeshError(f"the mesh has no {kind} '{name}'{hint}; it has {', '.join(sorted(table)) or 'none'}.")
