"""Patches of elements that share one volume strain, for elements whose own one is too stiff (B̄).

A quadrilateral or hexahedron, and any quadratic element, is a patch by itself. Linear triangles and tetrahedra have one
volume strain each, which is too many for the nodes that there are: 2 for a node of a triangle mesh and 5 to 6 for
one of tetrahedra, where two and three unknowns leave room for one. They are gathered into patches of two and about
eight,
as de Souza Neto, Andrade Pires & Owen (2005) do for F̄, by joining neighbours across large faces once or three times.
No patch reaches across the border of a zone.
"""

import numpy as np

from fabfem.fem.elements import ELEMENTS
from fabfem.fem.facets import inner_facets
from fabfem.fem.mesh import Mesh

ROUNDS = {2: 1, 3: 3}
"""How often neighbours are joined, by dimension."""

Pairs = tuple[np.ndarray, np.ndarray]
"""(n, 2) things that touch, and (n,) by how large a face."""


def patches(mesh: Mesh) -> np.ndarray:
    """(nel,) number of the patch that each element belongs to."""
    if mesh.ranks.patches is not None:
        return mesh.ranks.patches
    label = np.arange(len(mesh.cells))
    if len(mesh.element.nodes) > mesh.dim + 1:
        return label
    touching = _neighbours(mesh)
    for _ in range(ROUNDS[mesh.dim]):
        label = _joined(label, _between(label, touching))
    return _without_crumbs(label, touching, 0.75 * 2 ** ROUNDS[mesh.dim])


def widened(cells: np.ndarray, label: np.ndarray, own: np.ndarray, volume: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of each element's patch (nel, width), its own first, and the patch means (nel, width, nterm) at them.

    `own` (nel, nnode, nterm) are volume integrals over the elements, `volume` (nel,) their volumes. Patches of fewer
    nodes are filled up with a node of theirs and means of zero.
    """
    if (label == np.arange(len(cells))).all():
        return cells, own / volume[:, None, None]
    nnode, nnodes = cells.shape[1], int(cells.max()) + 1
    keys, entry = np.unique((label[:, None] * nnodes + cells).ravel(), return_inverse=True)
    sums = [np.bincount(entry, part.ravel()) for part in np.moveaxis(own, 2, 0)]
    owner, node = np.divmod(keys, nnodes)
    means = np.stack(sums, axis=1) / np.bincount(label, volume)[owner][:, None]
    first, count = np.searchsorted(owner, label), np.bincount(owner)[label]
    place = np.arange(count.max())
    inside = place < count[:, None]
    entries = np.where(inside, first[:, None] + place, first[:, None])
    mine = node[entries][:, :, None] == cells[:, None, :]
    rank = np.where(mine.any(axis=2), mine.argmax(axis=2), nnode + place)
    order = np.argsort(np.where(inside, rank, nnode + len(place)), axis=1)
    entries, inside = np.take_along_axis(entries, order, axis=1), np.take_along_axis(inside, order, axis=1)
    return node[entries], means[entries] * inside[:, :, None]


def _neighbours(mesh: Mesh) -> Pairs:
    """Elements of the same zone with a common face, and the face's size."""
    elements, facets = inner_facets(mesh.cells, mesh.cell_type)
    zones = np.stack([np.isin(np.arange(len(mesh.cells)), ids) for ids in mesh.zones.values()], axis=1)
    same = (zones[elements[:, 0]] == zones[elements[:, 1]]).all(axis=1)
    edges = np.diff(mesh.points[facets[same]], axis=1)
    gram = edges @ np.swapaxes(edges, 1, 2)
    return elements[same], np.sqrt(np.linalg.det(gram)) / len(ELEMENTS[mesh.element.facet_type].corners[0])


def _between(label: np.ndarray, touching: Pairs) -> Pairs:
    """Patches that touch, and the sum of their common faces."""
    elements, size = touching
    pairs = np.sort(label[elements], axis=1)
    apart = pairs[:, 0] != pairs[:, 1]
    unique, number = np.unique(pairs[apart], axis=0, return_inverse=True)
    return unique, np.bincount(number.ravel(), size[apart], len(unique))


def _joined(label: np.ndarray, touching: Pairs) -> np.ndarray:
    """The labels after each patch has joined one neighbour at most, those with the largest faces between them first."""
    into = np.arange(label.max() + 1)
    single = np.ones(len(into), bool)
    for a, b in touching[0][np.argsort(-_rounded(touching[1]), kind="stable")].tolist():
        if single[a] and single[b]:
            single[a] = single[b] = False
            into[b] = a
    return _renumbered(into[label])


def _without_crumbs(label: np.ndarray, touching: Pairs, enough: float) -> np.ndarray:
    """The labels after patches of fewer elements than `enough` have joined their smallest neighbour."""
    pairs, _ = _between(label, touching)
    into, size = np.arange(label.max() + 1), np.bincount(label).astype(float)
    for small in np.flatnonzero(size < enough).tolist():
        others = np.setdiff1d(into[pairs[(pairs == small).any(axis=1)]], into[small])
        if size[into[small]] < enough and len(others):
            best = others[size[others].argmin()]
            size[best] += size[into[small]]
            into[into == into[small]] = best
    return _renumbered(into[label])


def _rounded(size: np.ndarray) -> np.ndarray:
    """Sizes with the round-off taken away that would decide between equal ones."""
    return np.round(size / size.max(initial=1e-300), 9)


def _renumbered(label: np.ndarray) -> np.ndarray:
    return np.unique(label, return_inverse=True)[1]
