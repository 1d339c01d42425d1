"""The fabric as ellipsoids on a lattice, long where contact normals gather."""

from collections.abc import Iterator

import numpy as np
import pyvista
from numpy.typing import NDArray

from fabfem.pictures.frame import WIDE, Array, facing, grid_is_solid

GLYPHS_ACROSS = 24
"""Fabric glyphs across the picture."""
STRETCH = 1.5
"""Exaggeration of the anisotropy of a fabric glyph."""


def ellipsoids(grid: pyvista.UnstructuredGrid, bounds: tuple[float, ...]) -> Iterator[pyvista.PolyData]:
    """Yield an ellipsoid for each place of a lattice, with the norm of the fabric there."""
    spacing = max(bounds[1] - bounds[0], WIDE * (bounds[3] - bounds[2])) / GLYPHS_ACROSS
    ball = pyvista.Sphere(radius=1.0, theta_resolution=36, phi_resolution=19)
    centres, fabric = sampled(grid, bounds, spacing)
    for centre, tensor in zip(centres, fabric, strict=True):
        shape = np.eye(3) + STRETCH * tensor
        glyph = ball.copy()
        glyph.points = (centre + 0.45 * spacing * ball.points @ shape / np.linalg.norm(shape, 2)).astype(np.float32)
        glyph["norm"] = np.full(glyph.n_points, np.linalg.norm(tensor))
        yield glyph


def sampled(grid: pyvista.UnstructuredGrid, bounds: tuple[float, ...], spacing: float) -> tuple[Array, Array]:
    """Return places on a regular lattice that lie well in the grid, and the fabric tensors there."""
    low, high = np.array(bounds).reshape(3, 2).T
    axes = [np.arange(a + spacing / 2, b, spacing) if b > a else np.array([a]) for a, b in zip(low, high, strict=True)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    straight = grid.linear_copy()
    inside = np.ones(len(lattice), dtype=bool)
    for direction in np.vstack([np.eye(3), -np.eye(3)]) * (high > low):
        inside &= np.asarray(straight.find_containing_cell(lattice + 0.4 * spacing * direction)) >= 0
    probed = pyvista.PolyData(lattice[inside]).sample(straight, tolerance=1e-6 * grid.length)
    good = np.isfinite(probed["fabric"]).all(axis=1) & (probed["vtkValidPointMask"] > 0)
    shown = good & near_faces(lattice[inside], spacing, facing(grid)) if grid_is_solid(grid) else good
    return lattice[inside][shown], tensors(probed["fabric"][shown])


def near_faces(places: Array, spacing: float, side: Array) -> NDArray[np.bool_]:
    """Return which places of a lattice lie in the outermost layer of either upright face that is looked at."""
    outermost = np.where(side < 0.0, places.min(axis=0), places.max(axis=0))
    return (np.abs(places - outermost)[:, :2] < 0.5 * spacing).any(axis=1)


def tensors(components: Array) -> Array:
    """Return (n, 3, 3) tensors of (n, 6) components in VTK's order XX YY ZZ XY YZ XZ."""
    return np.asarray(components, float)[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
