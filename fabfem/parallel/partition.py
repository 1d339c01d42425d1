"""The division of a mesh into parts by elements, with PETSc's DMPlex and the partitioner that it prefers.

The first rank reads the mesh and sends each rank its part, one after another; the others never hold the whole.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from fabfem.fem.mesh import Mesh, owners
from fabfem.parallel.rank import Part, Rank
from fabfem.parallel.solver import Settings
from fabfem.parallel.team import Whole


def divided(whole: Whole, told: Callable[[Mesh], str], settings: Settings) -> Mesh:
    """Return this rank's part of a mesh.

    Parameters
    ----------
    whole : Whole
    told : callable
        What a mesh is told apart by.
    settings : Settings
        What the linear solvers of the rank are made with.
    """
    comm = whole.comm
    part_of = _parts(whole.mesh, comm)
    if whole.mesh is None or whole.patch is None:
        mesh, part = comm.recv(source=0)
    else:
        _keep_together(part_of, whole.patch, comm.size)
        pieces = _pieces(whole.mesh, part_of, whole.patch, told(whole.mesh), comm.size)
        mesh, part = next(pieces)
        for rank, piece in enumerate(pieces, 1):
            comm.send(piece, dest=rank)
    return replace(mesh, ranks=Rank(comm, part, settings))


def _parts(mesh: Mesh | None, comm: MPI.Comm) -> np.ndarray:
    """Return the rank of each element, on the first rank; nothing on the others."""
    size = comm.bcast((mesh.dim, len(mesh.element.corners), len(mesh.cells)) if mesh else None)
    dim, ncorner, nel = size
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


def _keep_together(part_of: np.ndarray, patch: np.ndarray, size: int) -> None:
    """Let each patch follow its first element to one rank; where that leaves a rank without any, deal them in order."""
    _, first, number = np.unique(patch, return_index=True, return_inverse=True)
    for of_patch in (part_of[first], np.arange(len(first)) * size // len(first)):
        part_of[:] = of_patch[number]
        if len(np.unique(part_of)) == size:
            return


def _pieces(mesh: Mesh, part_of: np.ndarray, patch: np.ndarray, told: str, size: int) -> Iterator[tuple[Mesh, Part]]:
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
        known = np.unique(patch[elements], return_inverse=True)[1]
        part = Part(elements, nodes, int(mine.sum()), number[nodes[mine.sum() :]], known, touching, told)
        yield Mesh(mesh.points[nodes], local[mesh.cells[elements]], mesh.cell_type, zones, sides), part


def _numbered(chosen: np.ndarray, n: int) -> np.ndarray:
    """Return the place of each of n things in a choice of them, -1 where it is not chosen."""
    place = np.full(n, -1)
    place[chosen] = np.arange(len(chosen))
    return place
