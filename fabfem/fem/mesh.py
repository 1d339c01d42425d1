"""Meshes with named zones and boundaries, read by meshio from any format that carries names.

A zone is a set of elements, a boundary a set of facets. gmsh's physical groups and Abaqus's element sets give both;
a node set (Abaqus) gives the outer facets whose nodes all belong to it.
"""

from collections.abc import Iterable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from difflib import get_close_matches
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fabfem.fem.elements import ELEMENTS, ElementType, quadrature, shape
from fabfem.fem.ranks import ALONE, Alone

if TYPE_CHECKING:
    import meshio


class MeshError(ValueError):
    """A mesh that cannot be used, said in one sentence."""


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
    facets = _facets(cells, element)
    zones: dict[str, np.ndarray] = {}
    boundaries: dict[str, np.ndarray] = {}
    for name, blocks in (raw.cell_sets or _physical(raw)).items():
        if not name.startswith("gmsh:"):
            _add(zones, name, _elements_in(raw, blocks, cell_type))
            _add(boundaries, name, _matching(facets, _facets_in(raw, blocks, element.facet_type), element))
    for name, nodes in raw.point_sets.items():
        _add(boundaries, name, outer_facets(cells, cell_type, nodes))
    zones = zones or {"all": np.arange(len(cells))}
    return checked(_compact(_flat(raw.points, element.dim), cells, cell_type, zones, boundaries))


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
    facets = _facets(cells, new)
    boundaries = {name: _matching(facets, b, new) for name, b in mesh.boundaries.items()}
    return replace(mesh, points=points, cells=cells, cell_type=new.name, boundaries=boundaries)


def outer_facets(cells: np.ndarray, cell_type: str, nodes: np.ndarray) -> np.ndarray:
    """(n, nfacetnode) facets of one element only whose nodes are all in `nodes`."""
    element = ELEMENTS[cell_type]
    facets = _facets(cells, element)
    inside = facets[np.isin(facets, nodes).all(axis=1)]
    corners = np.sort(inside[:, : _ncorner(element)], axis=1)
    _, key = distinct(corners)
    return inside[np.bincount(key)[key] == 1]


def inner_facets(cells: np.ndarray, cell_type: str) -> tuple[np.ndarray, np.ndarray]:
    """(n, 2) elements that share a facet, and (n, nfacetnode) its nodes."""
    element = ELEMENTS[cell_type]
    facets = _facets(cells, element)
    corners = np.sort(facets[:, : _ncorner(element)], axis=1)
    order = np.lexsort(corners.T)
    twin = np.flatnonzero((corners[order[1:]] == corners[order[:-1]]).all(axis=1))
    elements = np.stack([order[twin], order[twin + 1]], axis=1) // len(element.facets)
    return np.sort(elements, axis=1), facets[order[twin]]


def owners(mesh: Mesh, facets: np.ndarray) -> np.ndarray:
    """(n,) an element that each of some facets (n, nfacetnode) of a mesh belongs to."""
    width = _ncorner(mesh.element)
    every = np.sort(_facets(mesh.cells, mesh.element)[:, :width], axis=1)
    keys = np.vstack([every, np.sort(facets[:, :width], axis=1)])
    first, key = distinct(keys)
    return first[key[len(every) :]] // len(mesh.element.facets)


def distinct(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where each distinct row (n, k) of whole numbers from 0 on is first, in their order, and (n,) which each row is.

    Numbers instead of rows are sorted; `numpy.unique` of rows takes five times as long.
    """
    first, number = np.zeros(0, int), np.zeros(len(rows), np.int64)
    for column in rows.T:
        keys = number * (int(column.max(initial=0)) + 1) + column
        _, first, number = np.unique(keys, return_index=True, return_inverse=True)
    return first, number


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


def _named(table: dict[str, np.ndarray], name: str, kind: str) -> np.ndarray:
    if name in table:
        return table[name]
    near = get_close_matches(name, table, n=1)
    hint = f", did you mean '{near[0]}'" if near else ""
    raise MeshError(f"the mesh has no {kind} '{name}'{hint}; it has {', '.join(sorted(table)) or 'none'}.")


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


def _facets(cells: np.ndarray, element: ElementType) -> np.ndarray:
    """(nel * nfacets, nfacetnode) nodes of every element's facets."""
    return cells[:, np.array(element.facets)].reshape(-1, len(element.facets[0]))


def _ncorner(element: ElementType) -> int:
    return len(ELEMENTS[element.facet_type].corners)


def _matching(facets: np.ndarray, wanted: np.ndarray, element: ElementType) -> np.ndarray:
    """The elements' own facets that have the same corners as `wanted`, each once."""
    ncorner = _ncorner(element)
    keys = np.vstack([np.sort(wanted[:, :ncorner], axis=1), np.sort(facets[:, :ncorner], axis=1)])
    _, key = distinct(keys)
    asked, mine = np.unique(key[: len(wanted)]), key[len(wanted) :]
    found, first = np.unique(mine, return_index=True)
    if not np.isin(asked, found).all():
        raise MeshError("a boundary has facets that belong to no element; mesh and boundary do not fit together.")
    return facets[np.sort(first[np.isin(found, asked)])]


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
