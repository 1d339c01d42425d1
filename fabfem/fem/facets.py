"""Facets of the elements of a mesh: which are outer, which lie between two elements, which belong to a boundary.

Two facets are the same where their corners are, in whatever order.
"""

import numpy as np

from fabfem.fem.elements import ELEMENTS, ElementType


class MeshError(ValueError):
    """A mesh that cannot be used, said in one sentence."""


def outer_facets(cells: np.ndarray, cell_type: str, nodes: np.ndarray) -> np.ndarray:
    """(n, nfacetnode) facets of one element only whose nodes are all in `nodes`."""
    element = ELEMENTS[cell_type]
    facets = facets_of(cells, element)
    inside = facets[np.isin(facets, nodes).all(axis=1)]
    _, key = distinct(corners_of(inside, element))
    return inside[np.bincount(key)[key] == 1]


def inner_facets(cells: np.ndarray, cell_type: str) -> tuple[np.ndarray, np.ndarray]:
    """(n, 2) elements that share a facet, and (n, nfacetnode) its nodes."""
    element = ELEMENTS[cell_type]
    facets = facets_of(cells, element)
    corners = corners_of(facets, element)
    order = np.lexsort(corners.T)
    twin = np.flatnonzero((corners[order[1:]] == corners[order[:-1]]).all(axis=1))
    elements = np.stack([order[twin], order[twin + 1]], axis=1) // len(element.facets)
    return np.sort(elements, axis=1), facets[order[twin]]


def distinct(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where each distinct row (n, k) of whole numbers from 0 on is first, in their order, and (n,) which each row is.

    Numbers instead of rows are sorted; `numpy.unique` of rows takes five times as long.
    """
    first, number = np.zeros(0, int), np.zeros(len(rows), np.int64)
    for column in rows.T:
        keys = number * (int(column.max(initial=0)) + 1) + column
        _, first, number = np.unique(keys, return_index=True, return_inverse=True)
    return first, number


def facets_of(cells: np.ndarray, element: ElementType) -> np.ndarray:
    """(nel * nfacets, nfacetnode) nodes of every element's facets."""
    return cells[:, np.array(element.facets)].reshape(-1, len(element.facets[0]))


def corners_of(facets: np.ndarray, element: ElementType) -> np.ndarray:
    """(n, ncorner) corners of facets (n, nfacetnode) of an element, ascending: the same for the same facet."""
    return np.sort(facets[:, : len(ELEMENTS[element.facet_type].corners)], axis=1)


def matching(facets: np.ndarray, wanted: np.ndarray, element: ElementType) -> np.ndarray:
    """The elements' own facets that have the same corners as `wanted`, each once."""
    _, key = distinct(np.vstack([corners_of(wanted, element), corners_of(facets, element)]))
    asked, mine = np.unique(key[: len(wanted)]), key[len(wanted) :]
    found, first = np.unique(mine, return_index=True)
    if not np.isin(asked, found).all():
        raise MeshError("a boundary has facets that belong to no element; mesh and boundary do not fit together.")
    return facets[np.sort(first[np.isin(found, asked)])]
