"""Who has work: the first process reads the mesh, and where there are more processes than parts, the others leave.

PETSc knows only those that stay, so nothing here imports it.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import petsc4py
from mpi4py import MPI

from fabfem.fem.mesh import Mesh
from fabfem.fem.patches import patches
from fabfem.parallel import world


class Whole(NamedTuple):
    """A mesh that is to be divided, and those who share it."""

    comm: MPI.Comm
    mesh: Mesh | None
    """On the first process alone."""
    patch: np.ndarray | None
    """(nel,) patch of each element, which stays on one process; on the first alone."""


def mustered(read: Callable[[], Mesh], together: Callable[[Mesh], bool], comm: MPI.Comm) -> Whole:
    """Return the mesh that `read` returns with those who share it, no more than there are patches.

    Parameters
    ----------
    read : callable
        Called by the first process alone.
    together : callable
        Whether elements of one patch (`fabfem.fem.patches`) must stay together; else each is a patch.
    comm : Comm

    Raises
    ------
    MeshError
        On every process, where the mesh cannot be read.
    SpareError
        On a process without work; `ended_together` lets it leave.
    """
    mesh = _on_first(read, comm)
    patch = _on_first(lambda: patches(mesh) if together(mesh) else np.arange(len(mesh.cells)), comm)
    comm = _without_spare(comm, comm.bcast(None if patch is None else len(np.unique(patch))))
    petsc4py.init(["fabfem"], comm=comm)
    return Whole(comm, mesh, patch)


def _on_first(make: Callable[[], Any], comm: MPI.Comm) -> Any:
    """Return what the first process makes, there; None on the others. What it refuses, all refuse."""
    made, trouble = None, None
    if comm.rank == 0:
        try:
            made = make()
        except ValueError as error:
            trouble = error
    if trouble := comm.bcast(trouble):
        raise trouble
    return made


def _without_spare(comm: MPI.Comm, most: int) -> MPI.Comm:
    """Return the communicator of those who have work, `most` of them at most."""
    if comm.size <= most:
        return comm
    own = comm.Split(0 if comm.rank < most else MPI.UNDEFINED, comm.rank)
    if own == MPI.COMM_NULL:
        raise world.SpareError
    world.keep_team(own)
    return own
