"""Meshes read by meshio from any format that carries names.

gmsh's physical groups and Abaqus's element sets name zones and boundaries; a node set (Abaqus) gives the outer facets
whose nodes all belong to it.
"""

from collections.abc import Iterable
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fabfem.fem.elements import ELEMENTS
from fabfem.fem.facets import MeshError, facets_of, matching, outer_facets
from fabfem.fem.mesh import Mesh, checked, quadratic

if TYPE_CHECKING:
    import meshio


def read_mesh(path: str | Path, order: int | None = None) -> Mesh:
    """The mesh in a file; order=2 turns linear elements into quadratic ones.

    Raises MeshError where the file is missing or unreadable, mixes elements, has inverted ones, or quadratic ones for
    order=1.
    """
    mesh = from_meshio(_read(Path(path)))
    if order == 1 and mesh.element.midside:
        raise MeshError(f"{Path(path).name} has elements of order 2 ({mesh.cell_type}), and order 1 is asked for")
    return quadratic(mesh) if order == 2 and mesh.element.quadratic else mesh


def from_meshio(raw: "meshio.Mesh") -> Mesh:
    """The mesh in a meshio record."""
    cell_type = _cell_type([block.type for block in raw.cells])
    element = ELEMENTS[cell_type]
    cells = np.vstack([block.data for block in raw.cells if block.type == cell_type])
    facets = facets_of(cells, element)
    zones: dict[str, np.ndarray] = {}
    boundaries: dict[str, np.ndarray] = {}
    for name, blocks in (raw.cell_sets or _physical(raw)).items():
        if not name.startswith("gmsh:"):
            _add(zones, name, _elements_in(raw, blocks, cell_type))
            _add(boundaries, name, matching(facets, _facets_in(raw, blocks, element.facet_type), element))
    for name, nodes in raw.point_sets.items():
        _add(boundaries, name, outer_facets(cells, cell_type, nodes))
    zones = zones or {"all": np.arange(len(cells))}
    return checked(_compact(_flat(raw.points, element.dim), cells, cell_type, zones, boundaries))


def _read(path: Path) -> "meshio.Mesh":
    """What meshio reads; its prints and its exit become one sentence."""
    if not path.is_file():
        raise MeshError(f"there is no mesh file {path}.")
    _whole(path)
    import meshio
    from meshio.abaqus._abaqus import abaqus_to_meshio_type

    for name, cell_type in _ABAQUS.items():
        abaqus_to_meshio_type.setdefault(name, cell_type)
    said = StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            return _middle_last(meshio.read(path), path)
    except (meshio.ReadError, LookupError, SystemExit, TypeError, ValueError) as error:
        reason = said.getvalue().partition("\n")[0] or str(error) or "unknown format"
        raise MeshError(f"{path.name} cannot be read as a mesh: {reason.rstrip('.')}.") from error


def _whole(path: Path) -> None:
    """Raise MeshError for an Abaqus file cut within a line: the format does not mark its end, and a part reads well."""
    if path.suffix.lower() == ".inp" and not path.read_bytes().endswith(b"\n"):
        raise MeshError(
            f"{path.name} ends within a line: it is cut short, or it lacks the line end behind the last one."
        )


def _middle_last(raw: "meshio.Mesh", path: Path) -> "meshio.Mesh":
    """The mesh with the middle node of a line last: Abaqus numbers it along the line, and meshio leaves it there."""
    if path.suffix.lower() == ".inp":
        for block in raw.cells:
            if block.type == "line3":
                block.data = block.data[:, [0, 2, 1]]
    return raw


_ABAQUS = {
    kind + nodes + reduced: cell_type
    for kind in ("CPE", "CPS", "CAX")
    for nodes, cell_type in (("3", "triangle"), ("4", "quad"), ("6", "triangle6"), ("8", "quad8"))
    for reduced in ("", "R")
}
"""Abaqus's plane and axisymmetric elements, of which meshio knows three."""


def _physical(raw: "meshio.Mesh") -> dict[str, list[np.ndarray]]:
    """Numbers, by block, of the cells in each physical group: gmsh's format 2.2, of which meshio makes no sets."""
    from meshio._mesh import topological_dimension

    tags = raw.cell_data.get("gmsh:physical", [])
    dims = [topological_dimension[block.type] for block in raw.cells]
    return {
        name: [
            np.flatnonzero(tag == group) if dim == of else np.zeros(0, int) for tag, of in zip(tags, dims, strict=True)
        ]
        for name, (group, dim) in raw.field_data.items()
        if len(tags)
    }


def _cell_type(types: Iterable[str]) -> str:
    known = {t for t in types if t in ELEMENTS}
    top = max((ELEMENTS[t].dim for t in known), default=0)
    found = sorted(t for t in known if ELEMENTS[t].dim == top)
    unknown = sorted(set(types) - known - {"vertex"})
    if top < 2 or unknown:
        have = ", ".join(sorted(set(types))) or "none"
        raise MeshError(
            f"the mesh has elements {have}; usable are {', '.join(e for e in ELEMENTS if ELEMENTS[e].dim > 1)}."
        )
    if len(found) > 1:
        raise MeshError(f"the mesh mixes {' and '.join(found)}; a mesh has one kind of element.")
    return found[0]


def _add(table: dict[str, np.ndarray], name: str, items: np.ndarray) -> None:
    if len(items):
        table[name] = items


def _elements_in(raw: "meshio.Mesh", blocks: list, cell_type: str) -> np.ndarray:
    """Numbers, among all elements of `cell_type`, of those in a set."""
    first, found = 0, []
    for block, chosen in zip(raw.cells, blocks, strict=True):
        if block.type == cell_type:
            if chosen is not None:
                found.append(first + np.asarray(chosen, int))
            first += len(block.data)
    return np.unique(np.concatenate(found)) if found else np.zeros(0, int)


def _facets_in(raw: "meshio.Mesh", blocks: list, facet_type: str) -> np.ndarray:
    """(n, nfacetnode) nodes of the facets in a set."""
    width = len(ELEMENTS[facet_type].nodes)
    chosen = [
        block.data[np.asarray(ids, int)]
        for block, ids in zip(raw.cells, blocks, strict=True)
        if ids is not None and block.type == facet_type
    ]
    return np.vstack([np.zeros((0, width), int), *chosen])


def _flat(points: np.ndarray, dim: int) -> np.ndarray:
    """Coordinates in the dimension of the elements."""
    extra = points[:, dim:]
    if extra.size and np.ptp(extra) > 1e-9 * np.ptp(points[:, :dim]):
        raise MeshError("a two-dimensional mesh must lie in the plane z = 0 (x horizontal or radial, y up).")
    return np.ascontiguousarray(points[:, :dim], float)


def _compact(points: np.ndarray, cells: np.ndarray, cell_type: str, zones: dict, boundaries: dict) -> Mesh:
    """The mesh without nodes that belong to no element."""
    used = np.unique(cells)
    new = np.full(len(points), -1)
    new[used] = np.arange(len(used))
    return Mesh(points[used], new[cells], cell_type, zones, {name: new[b] for name, b in boundaries.items()})
