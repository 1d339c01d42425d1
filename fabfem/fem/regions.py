"""Parts of a mesh that are named by where they lie: facets of a boundary, elements of zones."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fabfem.fem.facets import MeshError
from fabfem.fem.mesh import Mesh

TOLERANCE = 1e-9
"""Over the size of the mesh: how far outside a region what lies on its border may be."""


class Region(NamedTuple):
    """A box along the axes."""

    lower: tuple[float, ...]
    """Corner with the smallest coordinates [length]."""
    upper: tuple[float, ...]
    """Corner with the largest coordinates [length]."""

    def __str__(self) -> str:
        """Return the corners in words."""
        low, high = (", ".join(f"{value:g}" for value in corner) for corner in self)
        return f"between ({low}) and ({high})"


def with_boundaries(mesh: Mesh, parts: Mapping[str, tuple[str, Region]]) -> Mesh:
    """Return the mesh with further boundaries, by name: all facets of another boundary that lie in a region.

    Raises
    ------
    MeshError
        Where a name is taken or a part is empty, or the region has other axes than the mesh.
    """
    boundaries = dict(mesh.boundaries)
    for name, (of, region) in parts.items():
        _new(name, boundaries, "boundary")
        facets = replace(mesh, boundaries=boundaries).boundary(of)
        found = facets[_within(mesh, region, name)[facets].all(axis=1)]
        if not len(found):
            raise MeshError(f"boundary '{name}' is empty: no facet of '{of}' lies {region}.")
        boundaries[name] = found
    return replace(mesh, boundaries=boundaries)


def with_zones(mesh: Mesh, parts: Mapping[str, Region]) -> Mesh:
    """Return the mesh with further zones, by name: all elements whose corners have their mean in a region.

    An element leaves the zone it was in; a zone that loses all is gone.

    Raises
    ------
    MeshError
        Where a name is taken or a part is empty, or the region has other axes than the mesh.
    """
    if not parts:
        return mesh
    zones = dict(mesh.zones)
    centres = mesh.points[mesh.cells[:, : len(mesh.element.corners)]].mean(axis=1)
    for name, region in parts.items():
        _new(name, zones, "zone")
        found = np.flatnonzero(_within(mesh, region, name, centres))
        if not len(found):
            raise MeshError(f"zone '{name}' is empty: no element lies {region}.")
        left = {other: np.setdiff1d(elements, found) for other, elements in zones.items()}
        zones = {other: elements for other, elements in left.items() if len(elements)} | {name: found}
    return replace(mesh, zones=zones)


def _new(name: str, known: Mapping[str, np.ndarray], kind: str) -> None:
    if name in known:
        raise MeshError(f"the mesh has a {kind} '{name}' already.")


def _within(mesh: Mesh, region: Region, name: str, points: np.ndarray | None = None) -> np.ndarray:
    """Return which points (n, dim), those of the mesh by default, lie in a region."""
    if len(region.lower) != mesh.dim:
        raise MeshError(f"'{name}' has corners of {len(region.lower)} axes, and the mesh has {mesh.dim}.")
    where = mesh.points if points is None else points
    near = TOLERANCE * np.ptp(mesh.points, axis=0).max()
    return ((where >= np.subtract(region.lower, near)) & (where <= np.add(region.upper, near))).all(axis=1)
