"""Boxes cut into elements along each axis, with a name for every side."""

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from fabfem.fem.elements import ELEMENTS
from fabfem.fem.facets import outer_facets
from fabfem.fem.mesh import Mesh, checked, quadratic

SIDES = {2: (("left", "right"), ("bottom", "top")), 3: (("left", "right"), ("front", "back"), ("bottom", "top"))}
"""Names of the sides at the lower and upper end of each axis."""


def box_mesh(cell_type: str, counts: Sequence[int], lower: Sequence[float], upper: Sequence[float]) -> Mesh:
    """The box from corner `lower` to corner `upper` cut into `counts` equal cells along each axis; see `grid_mesh`."""
    return grid_mesh(
        cell_type, [np.linspace(low, high, n + 1) for low, high, n in zip(lower, upper, counts, strict=True)]
    )


def grid_mesh(cell_type: str, axes: Sequence[np.ndarray]) -> Mesh:
    """The box cut at ascending coordinates along each axis.

    Cells of triangles are cut along diagonals that alternate. The sides are boundaries, the whole is the zone "all".
    """
    linear = ELEMENTS[cell_type].linear or cell_type
    counts = [len(axis) - 1 for axis in axes]
    points = np.stack([x.ravel(order="F") for x in np.meshgrid(*axes, indexing="ij")], axis=1)
    cells = _CUTS[linear](_bricks(counts), counts)
    boundaries = {
        name: outer_facets(cells, linear, np.flatnonzero(points[:, axis] == end))
        for axis, names in enumerate(SIDES[len(counts)])
        for name, end in zip(names, (axes[axis][0], axes[axis][-1]), strict=True)
    }
    mesh = checked(Mesh(points, cells, linear, {"all": np.arange(len(cells))}, boundaries))
    return mesh if cell_type == linear else quadratic(mesh, cell_type)


def _bricks(counts: Sequence[int]) -> np.ndarray:
    """(ncell, 2**dim) corners of the cells, those of an axis that runs faster first."""
    number = np.arange(np.prod(np.array(counts) + 1)).reshape(np.array(counts) + 1, order="F")
    for axis in range(len(counts)):
        low, high = [np.take(number, np.arange(counts[axis]) + shift, axis=axis) for shift in (0, 1)]
        number = np.stack([low, high], axis=-1)
    return number.reshape(np.prod(counts), -1, order="F")


def _rings(bricks: np.ndarray, counts: Sequence[int]) -> np.ndarray:
    """Corners in the order of a quadrilateral or hexahedron: around, then up."""
    around = [0, 1, 3, 2]
    return bricks[:, around + [4 + i for i in around][: bricks.shape[1] - 4]]


def _triangles(bricks: np.ndarray, counts: Sequence[int]) -> np.ndarray:
    a, b, d, c = bricks.T
    i, j = np.unravel_index(np.arange(len(bricks)), tuple(counts), order="F")
    rising = np.stack([a, b, c, a, c, d], axis=1)
    falling = np.stack([a, b, d, b, c, d], axis=1)
    return np.where(((i + j) % 2 == 0)[:, None], rising, falling).reshape(-1, 3)


def _tetrahedra(bricks: np.ndarray, counts: Sequence[int]) -> np.ndarray:
    """Six tetrahedra about the long diagonal; they meet those of the next cell face to face."""
    paths = [np.cumsum([0, *(1 << axis for axis in order)]) for order in permutations(range(3))]
    turned = [path if i in (0, 3, 4) else path[[0, 2, 1, 3]] for i, path in enumerate(paths)]
    return bricks[:, np.array(turned)].reshape(-1, 4)


_CUTS = {"triangle": _triangles, "quad": _rings, "tetra": _tetrahedra, "hexahedron": _rings}
