"""The finite elements: node order, faces, shape functions and integration rules.

Nodes are in meshio (VTK) order; shape functions and quadrature are scikit-fem's, reordered by matching the reference
coordinates of the nodes. A new element is a row of ``ELEMENTS``.

Fewer points than an element's polynomials ask for free it of locking and cost less. They are offered where no
deformation without energy goes through a mesh: 4 points on quad8 and 8 on hexahedron20, not on quad9 and hexahedron27.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import skfem
from skfem.quadrature import get_quadrature

Nodes = tuple[int, ...]


@dataclass(frozen=True)
class ElementType:
    """One kind of element.

    Attributes
    ----------
    name : str
        meshio's name of the cell.
    corners : tuple
        Reference coordinates of the corner nodes.
    midside : tuple
        Corner nodes whose mean is each further node, in meshio order.
    basis : skfem.Element
        Shape functions.
    rules : dict
        Number of points -> polynomial order of the rule; the first is the default, order 0 is the centroid.
    facets : tuple
        Nodes of each face, in the order of the facet's own cell type.
    facet_type, linear, quadratic : str
        Names of related cell types; empty where there is none.
    """

    name: str
    corners: tuple[tuple[int, ...], ...]
    midside: tuple[Nodes, ...]
    basis: skfem.Element
    rules: dict[int, int]
    facets: tuple[Nodes, ...] = ()
    facet_type: str = ""
    linear: str = ""
    quadratic: str = ""

    @property
    def dim(self) -> int:
        """Dimension of the reference cell."""
        return len(self.corners[0])

    @property
    def nodes(self) -> np.ndarray:
        """(nnode, dim) reference coordinates of all nodes."""
        corners = np.array(self.corners, float)
        return np.vstack([corners, *[corners[list(m)].mean(axis=0) for m in self.midside]])


def shape(element: ElementType, where: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, nnode) values and (n, nnode, dim) reference gradients of the shape functions at `where` (n, dim)."""
    pairs = [element.basis.lbasis(where.T, i) for i in _order(element.name)]
    values = np.stack([np.broadcast_to(v, len(where)) for v, _ in pairs], axis=1)
    gradients = np.stack([np.reshape(g, (element.dim, -1)).T * np.ones((len(where), 1)) for _, g in pairs], axis=1)
    return values, gradients


def quadrature(element: ElementType, points: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """(nq, dim) places and (nq,) weights of the rule with `points` points, by default the element's usual one."""
    points = next(iter(element.rules)) if points is None else points
    if points not in element.rules:
        raise ValueError(f"{element.name} has no rule of {points} points; it has {sorted(element.rules)}.")
    where, weights = get_quadrature(element.basis.refdom, element.rules[points])
    if points == 1:  # scikit-fem's lowest rule on a triangle has three points
        return np.mean(element.corners, axis=0)[None], weights.sum(keepdims=True)
    return np.ascontiguousarray(where.T), weights


@cache
def _order(name: str) -> Nodes:
    """For each node in meshio order, the scikit-fem shape function that is one there."""
    element = ELEMENTS[name]
    gap = np.abs(element.nodes[:, None, :] - np.asarray(element.basis.doflocs)[None, :, : element.dim]).max(axis=2)
    return tuple(int(i) for i in gap.argmin(axis=1))


_LINE = ((0,), (1,))
_TRI = ((0, 0), (1, 0), (0, 1))
_QUAD = ((0, 0), (1, 0), (1, 1), (0, 1))
_TET = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
_HEX = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))

_TRI_EDGES = ((0, 1), (1, 2), (2, 0))
_QUAD_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0))
_TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
_HEX_EDGES = (
    *((0, 1), (1, 2), (2, 3), (3, 0)),
    *((4, 5), (5, 6), (6, 7), (7, 4)),
    *((0, 4), (1, 5), (2, 6), (3, 7)),
)
_TET_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
_HEX_FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))

_GAUSS = {4: 3, 9: 5}  # points -> order of the tensor rule on a square
_GAUSS3 = {8: 3, 27: 5}


def _with_midnodes(faces: tuple[Nodes, ...], midside: tuple[Nodes, ...], ncorner: int) -> tuple[Nodes, ...]:
    """Faces with the further nodes that lie on their edges and, where the element has it, at their centre."""
    at = {frozenset(m): ncorner + i for i, m in enumerate(midside)}
    return tuple((*face, *(at[p] for p in _edges(face) if p in at)) for face in faces)


def _edges(face: Nodes) -> list[frozenset[int]]:
    """Corner pairs of a face in order, then the whole face for its centre node."""
    if len(face) == 2:
        return [frozenset(face)]
    return [frozenset((a, face[(i + 1) % len(face)])) for i, a in enumerate(face)] + [frozenset(face)]


_HEX_ALL = (*_HEX_EDGES, *_HEX_FACES, tuple(range(8)))

ELEMENTS = {
    e.name: e
    for e in (
        ElementType("line", _LINE, (), skfem.ElementLineP1(), {2: 3}),
        ElementType("line3", _LINE, ((0, 1),), skfem.ElementLineP2(), {3: 5}, linear="line"),
        ElementType(
            *("triangle", _TRI, (), skfem.ElementTriP1(), {1: 0, 3: 2}),
            *(_TRI_EDGES, "line", "", "triangle6"),
        ),
        ElementType(
            *("triangle6", _TRI, _TRI_EDGES, skfem.ElementTriP2(), {3: 2, 6: 4, 7: 5}),
            *(_with_midnodes(_TRI_EDGES, _TRI_EDGES, 3), "line3", "triangle"),
        ),
        ElementType("quad", _QUAD, (), skfem.ElementQuad1(), {4: 3}, _QUAD_EDGES, "line", "", "quad8"),
        ElementType(
            *("quad8", _QUAD, _QUAD_EDGES, skfem.ElementQuadS2(), _GAUSS),
            *(_with_midnodes(_QUAD_EDGES, _QUAD_EDGES, 4), "line3", "quad"),
        ),
        ElementType(
            *("quad9", _QUAD, (*_QUAD_EDGES, (0, 1, 2, 3)), skfem.ElementQuad2(), {9: 5}),
            *(_with_midnodes(_QUAD_EDGES, _QUAD_EDGES, 4), "line3", "quad"),
        ),
        ElementType("tetra", _TET, (), skfem.ElementTetP1(), {1: 0, 4: 2}, _TET_FACES, "triangle", "", "tetra10"),
        ElementType(
            *("tetra10", _TET, _TET_EDGES, skfem.ElementTetP2(), {4: 2, 14: 5}),
            *(_with_midnodes(_TET_FACES, _TET_EDGES, 4), "triangle6", "tetra"),
        ),
        ElementType("hexahedron", _HEX, (), skfem.ElementHex1(), {8: 3}, _HEX_FACES, "quad", "", "hexahedron20"),
        ElementType(
            *("hexahedron20", _HEX, _HEX_EDGES, skfem.ElementHexS2(), _GAUSS3),
            *(_with_midnodes(_HEX_FACES, _HEX_EDGES, 8), "quad8", "hexahedron"),
        ),
        ElementType(
            *("hexahedron27", _HEX, _HEX_ALL, skfem.ElementHex2(), {27: 5}),
            *(_with_midnodes(_HEX_FACES, _HEX_ALL, 8), "quad9", "hexahedron"),
        ),
    )
}
