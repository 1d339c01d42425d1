"""The division of a mesh into parts by elements, with PETSc's DMPlex and the partitioner that it prefers.

The first rank reads the mesh and sends each rank its part, one after another; the others never hold the whole.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from fabfem.fem.mesh import Mesh, MeshError, owners
from fabfem.fem.patches import patches
from fabfem.parallel.rank import Part, Rank
from fabfem.parallel.solver import Settings


def divided(
    read: Callable[[], Mesh], told: Callable[[Mesh], str], together: Callable[[Mesh], bool], comm: MPI.Comm,
    settings: Settings,
) -> Mesh:  # fmt: skip
    """Return this rank's part of the mesh that `read` returns.

    Parameters
    ----------
    read : callable
        Called by the first rank alone.
    told : callable
        What a mesh is told apart by.
    together : callable
        Whether elements of one patch (`fabfem.fem.patches`) must stay on one rank.
    comm : Comm
    settings : Settings
        What the linear solvers of the rank are made with.

    Raises
    ------
    MeshError
        On every rank, where there are more ranks than elements or the mesh cannot be read.
    """
    whole = _on_first(read, comm)
    part_of = _parts(whole, comm)
    label = _on_first(lambda: _labels(whole, part_of, together(whole), comm.size), comm)
    if whole is None:
        mesh, part = comm.recv(source=0)
    else:
        pieces = _pieces(whole, part_of, label, told(whole), comm.size)
        mesh, part = next(pieces)
        for rank, piece in enumerate(pieces, 1):
            comm.send(piece, dest=rank)
    return replace(mesh, ranks=Rank(comm, part, settings))


def _on_first(make: Callable[[], Any], comm: MPI.Comm) -> Any:
    """Return what the first rank makes, there; None on the others. What it refuses, all refuse."""
    made, trouble = None, None
    if comm.rank == 0:
        try:
            made = make()
        except ValueError as error:
            trouble = error
    if trouble := comm.bcast(trouble):
        raise trouble
    return made


def _parts(mesh: Mesh | None, comm: MPI.Comm) -> np.ndarray:
    """Return the rank of each element, on the first rank; nothing on the others."""
    size = comm.bcast((mesh.dim, len(mesh.element.corners), len(mesh.cells)) if mesh else None)
    dim, ncorner, nel = size
    if nel < comm.size:
        raise MeshError(f"{comm.size} ranks cannot share {nel} elements.")
    if comm.size == 1:
        return np.zeros(nel, int)
    used, corners = np.unique(mesh.cells[:, :ncorner], return_inverse=True) if mesh else (np.zeros(0, int),) * 2
    cells = corners.reshape(-1, ncorner).astype(PETSc.IntType)
    if ncorner == 8:  # PETSc goes round the lower face of a hexahedron the other way
        cells = cells[:, [0, 3, 2, 1, 4, 5, 6, 7]]
    points = mesh.points[used] if mesh else np.zeros((0, dim))
    plex = PETSc.DMPlex().createFromCellList(dim, cells, np.ascontiguousarray(points), comm=comm)
    plex.getPartitioner().setFromOptions()  # the best that this PETSc was built with
    moved = plex.distribute()
    first, last = plex.getHeightStratum(0)
    _, leaves, roots = moved.getGraph()
    there = (leaves >= first) & (leaves < last)
    shares = comm.gather(roots[there, 1])
    part_of = np.zeros(nel if mesh else 0, int)
    for rank, elements in enumerate(shares or ()):
        part_of[elements] = rank
    return part_of


def _labels(mesh: Mesh, part_of: np.ndarray, together: bool, size: int) -> np.ndarray:
    """Return the patch of each element, and let each patch follow its first element to one rank."""
    label = patches(mesh) if together else np.arange(len(mesh.cells))
    _, first = np.unique(label, return_index=True)
    for proposed in (part_of, np.arange(len(label)) * size // len(label)):  # few elements: in their order
        part_of[:] = proposed[first[label]]
        if len(np.unique(part_of)) == size:
            break
    else:
        raise MeshError(f"{size} ranks are too many for this mesh: one of them gets no element.")
    return label


def _pieces(mesh: Mesh, part_of: np.ndarray, label: np.ndarray, told: str, size: int) -> Iterator[tuple[Mesh, Part]]:
    """Yield each rank's mesh and part."""
    owner = np.full(len(mesh.points), size)
    np.minimum.at(owner, mesh.cells, part_of[:, None])
    number = np.empty(len(owner), int)
    number[np.argsort(owner, kind="stable")] = np.arange(len(owner))
    facets = {name: part_of[owners(mesh, boundary)] for name, boundary in mesh.boundaries.items()}
    for rank in range(size):
        elements = np.flatnonzero(part_of == rank)
        nodes = np.unique(mesh.cells[elements])
        mine = owner[nodes] == rank
        nodes = np.concatenate([nodes[mine], nodes[~mine]])
        local, within = _numbered(nodes, len(mesh.points)), _numbered(elements, len(mesh.cells))
        zones = {name: within[ids][within[ids] >= 0] for name, ids in mesh.zones.items()}
        sides = {name: local[boundary[facets[name] == rank]] for name, boundary in mesh.boundaries.items()}
        touching = {
            name: np.setdiff1d(local[np.unique(boundary)], np.append(sides[name], -1))
            for name, boundary in mesh.boundaries.items()
        }
        known = np.unique(label[elements], return_inverse=True)[1]
        part = Part(elements, nodes, int(mine.sum()), number[nodes[mine.sum() :]], known, touching, told)
        yield Mesh(mesh.points[nodes], local[mesh.cells[elements]], mesh.cell_type, zones, sides), part


def _numbered(chosen: np.ndarray, n: int) -> np.ndarray:
    """Return the place of each of n things in a choice of them, -1 where it is not chosen."""
    place = np.full(n, -1)
    place[chosen] = np.arange(len(chosen))
    return place
