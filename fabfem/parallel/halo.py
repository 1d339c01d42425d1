"""The elements of other ranks around those of a rank, and what is known at their points.

A layer is all elements that have a node in common with those inside it. What is found once, elements and who has them,
is only as large as the border between the ranks; what changes, as a stress, is then sent for these elements alone.
"""

from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from fabfem.fem.mesh import Mesh
from fabfem.fem.ranks import Around


class _Elements(NamedTuple):
    """Some elements of a rank, by the numbers of the whole mesh."""

    number: np.ndarray
    owner: np.ndarray
    cells: np.ndarray
    """(nel, nnode)"""
    places: np.ndarray
    """(nel, nnode, dim) coordinates of the nodes."""
    zones: np.ndarray
    """(nel, nzone) whether they are in a zone."""

    def chosen(self, which: np.ndarray) -> "_Elements":
        return _Elements(*(part[which] for part in self))

    def touching(self, nodes: np.ndarray) -> "_Elements":
        return self.chosen(np.flatnonzero(np.isin(self.cells, nodes).any(axis=1)))


def around(comm: MPI.Comm, mesh: Mesh, number: np.ndarray, nodes: np.ndarray, layers: int) -> Around:
    """Return a rank's mesh with some layers of the others' elements behind its own.

    Parameters
    ----------
    comm : Comm
    mesh : Mesh
        The rank's part.
    number, nodes : int arrays
        Its elements and nodes in the whole mesh.
    layers : int
    """
    inside = np.stack([np.isin(np.arange(len(number)), ids) for ids in mesh.zones.values()], axis=1)
    rank = np.full(len(number), comm.rank)
    own = _Elements(number, rank, nodes[mesh.cells], mesh.points[mesh.cells], inside)
    shared = mesh.ranks.summed(np.ones((len(nodes), 1)))[:, 0] > 1.5
    every, outer, asked = own, own, nodes[shared]
    for _ in range(layers):
        outer = _layer(comm, own, every.number, asked)
        asked = np.setdiff1d(outer.cells, every.cells)
        every = _joined([every, outer])
    return Around(_mesh(mesh, nodes, every), _Sender(comm, number, every), len(every.number) - len(outer.number))


def _layer(comm: MPI.Comm, own: _Elements, known: np.ndarray, asked: np.ndarray) -> _Elements:
    """Return the elements of other ranks at the nodes that this rank asks for, without those it knows."""
    found = _joined(comm.alltoall([own.touching(nodes) for nodes in comm.allgather(asked)]))
    return found.chosen(~np.isin(found.number, known))


def _joined(parts: list[_Elements]) -> _Elements:
    return _Elements(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _mesh(mesh: Mesh, nodes: np.ndarray, every: _Elements) -> Mesh:
    """Return the elements as a mesh of its own, the rank's nodes first."""
    more, first = np.unique(every.cells, return_index=True)
    new = ~np.isin(more, nodes)
    whole = np.concatenate([nodes, more[new]])
    points = np.concatenate([mesh.points, every.places.reshape(-1, mesh.dim)[first[new]]])
    order = np.argsort(whole)
    cells = order[np.searchsorted(whole, every.cells, sorter=order)]
    zones = {name: np.flatnonzero(every.zones[:, k]) for k, name in enumerate(mesh.zones)}
    return Mesh(points, cells, mesh.cell_type, zones, {})


class _Sender:
    """Values (nel, ...) of a rank's elements -> those of all that it knows, in their order."""

    def __init__(self, comm: MPI.Comm, number: np.ndarray, every: _Elements) -> None:
        self._comm = comm
        wanted = every.chosen(slice(len(number), None))  # type: ignore[arg-type]
        self._order = np.argsort(wanted.owner, kind="stable")
        asked = comm.alltoall([wanted.number[wanted.owner == rank] for rank in range(comm.size)])
        self._sent = [np.searchsorted(number, some) for some in asked]

    def __call__(self, values: np.ndarray) -> np.ndarray:
        got = np.concatenate(self._comm.alltoall([values[some] for some in self._sent]))
        placed = np.empty_like(got)
        placed[self._order] = got
        return np.concatenate([values, placed])
