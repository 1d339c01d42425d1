"""Stress recovered from the points, and the discretisation error that it tells [Zienkiewicz & Zhu 1992].

Around every corner node the stress of the points is fitted by a polynomial of the degree of the displacement
(superconvergent patch recovery); the fits at the nodes, carried to the points by the shape functions, make a stress
that is closer to the truth than the one they come from. Their difference in the energy norm,
‖e‖² = ∫ (σ* − σ) : D⁻¹ : (σ* − σ) dV, estimates the error; D is the elastic tangent. A zone is recovered from its own
points, for the stress may jump between materials. At nodes in the middle of edges and faces the fits of their corners
are averaged; a patch with few points, as at a boundary, takes its neighbours' too.

Where several ranks share the mesh, a patch draws on the elements of other ranks, in as many layers as it takes.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import combinations_with_replacement

import numpy as np
from scipy.sparse import csr_matrix

from fabfem.fem.elements import ELEMENTS, shape
from fabfem.fem.kinematics import Kinematics
from fabfem.fem.space import Space, build_space

ENOUGH = 2
"""Points of a patch for each coefficient of the polynomial."""
LAYERS = 2
"""Layers of other ranks' elements that are asked for first: a patch at a border seldom draws on more than one."""
SLIGHT = 1e-3
"""Singular value below which points do not determine a coefficient, over the root of their number."""


def fine_space(space: Space) -> Space:
    """Return the space with the element's richest rule, in which an error that vanishes at the points is seen too.

    The strain of quadratic elements is best at the points of their usual, reduced rule: there alone an error of the
    stress would seem smaller by an order.
    """
    richest = max(space.mesh.element.rules)
    return build_space(space.mesh, space.kinematics, richest) if space.nq < richest else space


def stress_within(
    space: Space, fine: Space, stress: np.ndarray, tangent: np.ndarray, displacement: np.ndarray
) -> np.ndarray:
    """Return the (n, 6) stress of the elements at the points of the fine space.

    Between its points, where no material was asked, the stress follows the linear fit of the points, and what the
    strain has beyond its own linear fit, with the tangent of the nearest point.
    """
    if fine is space:
        return stress
    linear = ELEMENTS[space.mesh.element.linear or space.mesh.cell_type]
    fit = shape(linear, fine.where)[0] @ np.linalg.pinv(shape(linear, space.where)[0])
    beyond = fine.strain(displacement) - _spread(fit, space.strain(displacement), space)
    there = tangent.reshape(-1, space.nq, 6, 6)[:, nearest(space, fine)].reshape(-1, 6, 6)
    return _spread(fit, stress, space) + np.einsum("nij,nj->ni", there, beyond)


def nearest(space: Space, fine: Space) -> np.ndarray:
    """Return the (nq of the fine space,) point of an element that is nearest to each of its fine points."""
    gaps = np.linalg.norm(fine.where[:, None] - space.where[None], axis=2)
    return gaps.argmin(axis=1)


def _spread(fit: np.ndarray, values: np.ndarray, space: Space) -> np.ndarray:
    return np.einsum("fq,eqk->efk", fit, values.reshape(-1, space.nq, 6)).reshape(-1, 6)


def recovered(space: Space, fine: Space, zones: Iterable[str]) -> Callable[[np.ndarray], np.ndarray]:
    """Return the function from the stress at the points (npoints, 6) to that recovered at the n fine points (n, 6).

    All ranks call it together, once each with the stress of their own points.
    """
    ranks, layers, names = space.mesh.ranks, LAYERS, list(zones)
    while True:
        mesh, values, inner = ranks.around(space.mesh, layers)
        wider = space if mesh is space.mesh else build_space(mesh, _plain(space), space.nq)
        matrix = recovery(wider, fine, [mesh.zone(name) for name in names])
        # a patch that reaches the outermost layer may lack what lies beyond
        if not ranks.largest(int(matrix.indices.max(initial=-1) >= inner * space.nq)):
            return lambda stress: matrix @ values(stress.reshape(-1, space.nq, 6)).reshape(-1, 6)
        layers += 1


def _plain(space: Space) -> Kinematics:
    """Return the kinematics without means over patches, which a recovery does not need."""
    return replace(space.kinematics, mean_dilation=False)


def recovery(space: Space, fine: Space, zones: Iterable[np.ndarray]) -> csr_matrix:
    """Return the (n, npoints) matrix from the stress at the points to the recovered one at the n fine points.

    Parameters
    ----------
    space, fine : Space
        Where the stress is known, and where it is wanted: on the same elements or the first of them.
    zones : iterable of int arrays
        Elements of each zone; together all elements.
    """
    rows, columns, values = [np.zeros(0, int)], [np.zeros(0, int)], [np.zeros(0)]
    for elements in zones:
        for element, (points, matrix) in _at_nodes(space, elements, len(fine.mesh.cells)).items():
            rows.append(np.repeat(element * fine.nq + np.arange(fine.nq), len(points)))
            columns.append(np.tile(points, fine.nq))
            values.append((fine.values @ matrix).ravel())
    data, row, column = (np.concatenate(part) for part in (values, rows, columns))
    return csr_matrix((data, (row, column)), shape=(fine.npoints, space.npoints))


def energy_density(stress: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Return (n,) σ : D⁻¹ : σ of a stress (n, 6) with the elastic tangent (n, 6, 6)."""
    return np.einsum("ni,ni->n", stress, np.linalg.solve(tangent, stress[..., None])[..., 0])


def _at_nodes(space: Space, elements: np.ndarray, nel: int) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Return for each of the first `nel` elements its points and the (nnode, npoint) matrix from them to its nodes."""
    own = elements[elements < nel]
    fits = _fits(space, elements, own)
    corners = space.mesh.cells[:, : len(space.mesh.element.corners)]
    parents = [*((i,) for i in range(corners.shape[1])), *space.mesh.element.midside]
    found = {}
    for element in own:
        some_fits = [fits[corner] for corner in corners[element]]
        points = np.unique(np.concatenate([fit[0] for fit in some_fits]))
        matrix = np.zeros((len(parents), len(points)))
        nodes = space.mesh.points[space.mesh.cells[element]]
        for node, some in enumerate(parents):
            for corner in some:
                chosen, origin, size, inverse = some_fits[corner]
                row = monomials((nodes[node] - origin) / size, _degree(space)) @ inverse
                matrix[node, np.searchsorted(points, chosen)] += row / len(some)
        found[int(element)] = points, matrix
    return found


def _fits(
    space: Space, elements: np.ndarray, own: np.ndarray
) -> dict[int, tuple[np.ndarray, np.ndarray, float, np.ndarray]]:
    """Return for each corner of `own` its points, origin and size, and the matrix from points to coefficients."""
    ncorner = len(space.mesh.element.corners)
    corners = space.mesh.cells[elements, :ncorner]
    around: dict[int, list[int]] = {}
    for element, nodes in zip(elements.tolist(), corners.tolist(), strict=True):
        for node in nodes:
            around.setdefault(node, []).append(element)
    wanted = np.unique(space.mesh.cells[own, :ncorner]).tolist()
    return {node: _fit(space, node, _patch(space, around[node], around)) for node in wanted}


def _patch(space: Space, elements: list[int], around: dict[int, list[int]]) -> list[int]:
    """Return the elements around a node, with those around them where they have too few points."""
    ncorner = len(space.mesh.element.corners)
    while not _determined(_places(space, elements)[1], _degree(space)):
        nodes = np.unique(space.mesh.cells[elements, :ncorner])
        wider = sorted({element for node in nodes.tolist() for element in around[node]})
        if len(wider) == len(elements):
            break
        elements = wider
    return elements


def _fit(space: Space, node: int, elements: list[int]) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
    points, places = _places(space, elements)
    origin = space.mesh.points[node]
    away = places - origin
    size = float(np.abs(away).max())
    return points, origin, size, np.linalg.pinv(monomials(away / size, _degree(space)), rcond=1e-10)


def _places(space: Space, elements: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the points of some elements, in order, and where they are."""
    points = np.sort((np.array(elements)[:, None] * space.nq + np.arange(space.nq)).ravel())
    return points, space.points[points]


def _determined(places: np.ndarray, degree: int) -> bool:
    """Return whether points determine a polynomial well: enough of them, and not in too few layers."""
    middle = places.mean(axis=0)
    terms = monomials((places - middle) / max(float(np.abs(places - middle).max()), np.finfo(float).tiny), degree)
    if len(terms) < ENOUGH * terms.shape[1]:
        return False
    return bool(np.linalg.matrix_rank(terms, tol=SLIGHT * np.sqrt(len(terms))) == terms.shape[1])


def monomials(places: np.ndarray, degree: int) -> np.ndarray:
    """Return the (n, nterm) products of coordinates (n, dim) up to a degree; (nterm,) of one place (dim,)."""
    terms = [
        np.prod(places[..., list(axes)], axis=-1)
        for power in range(degree + 1)
        for axes in combinations_with_replacement(range(places.shape[-1]), power)
    ]
    return np.stack(np.broadcast_arrays(*terms), axis=-1)


def _degree(space: Space) -> int:
    """Return the degree of the displacement."""
    return 2 if ELEMENTS[space.mesh.cell_type].linear else 1
