"""Whether a run is shared, and by whom.

A launcher of processes tells each one its number in the environment; nothing of MPI is imported before that is seen.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic, sleep
from traceback import print_exc
from typing import Any

LAUNCHED = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK")
"""What the launchers of Open MPI, of MPICH and its kin, and of PMIx set."""
ALONE, DISTRIBUTED = ("superlu", "pardiso"), ("mumps", "multigrid")
"""Linear solvers of one process, and those of PETSc, by the names that a case has for them."""
MISSING = "it needs PETSc: 'pip install fabfem[mpi]' after what docs/parallel.md says about the system's packages"
PATIENCE = 3.0
"""Time that a rank which fails waits for the others to fail too [s]."""
_team: Any = None
"""Communicator of the processes that have work, where that is not all."""


class SpareError(Exception):
    """Nothing is left to do for a process, since there are more of them than parts to share."""


def launched() -> bool:
    """Return whether this process is one of several, or one that an MPI launcher started alone."""
    return any(name in os.environ for name in LAUNCHED)


def shared(case: Any) -> bool:
    """Return whether a run of a case is one of PETSc: by several processes, or by one that asks for it.

    Multigrid of one process is that of `fabfem.fem.multigrid`, unless the case has options for PETSc's.
    """
    return launched() or case.solver.linear == "mumps" or bool(case.solver.petsc)


def communicator(case: Any) -> Any:
    """Return the communicator of all processes that have work, or of this one where no launcher started it.

    Raises
    ------
    ValueError
        If the case names a solver that cannot be shared, or petsc4py or mpi4py is not installed.
    """
    if launched() and case.solver.linear in ALONE:
        raise ValueError(f"'{case.solver.linear}' is a solver of one process; several have {', '.join(DISTRIBUTED)}.")
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS") if launched() else ():
        os.environ.setdefault(name, "1")  # a rank is a process for each core already
    try:
        import petsc4py  # noqa: F401
        from mpi4py import MPI
    except ImportError as error:
        raise ValueError(MISSING) from error
    return (_team or MPI.COMM_WORLD) if launched() else MPI.COMM_SELF


def keep_team(comm: Any) -> None:
    """Keep the communicator of the processes that have work, for the others leave."""
    global _team
    _team = comm


def first() -> bool:
    """Return whether this process is the one that speaks."""
    if not launched():
        return True
    from mpi4py import MPI

    return MPI.COMM_WORLD.rank == 0


def share_cores(comm: Any, threads: int) -> None:
    """Let the processes of one machine share its cores, each `threads` of them or an equal part where that is 0."""
    from mpi4py import MPI

    import umat

    here = comm.Split_type(MPI.COMM_TYPE_SHARED).size
    umat.set_threads(threads or max(1, (os.cpu_count() or 1) // here))


@contextmanager
def ended_together(traceback: bool = False) -> Iterator[None]:
    """End the program on all ranks where one of them has failed.

    Where all fail alike, as on bad input, each goes on with its exception and the first tells it; where only some do,
    the others wait for them without end, so the failing rank says its reason and stops all. What was written stays.
    A rank that has nothing to do leaves without a word.
    """
    try:
        yield
    except SpareError:
        return
    except BaseException as error:
        if launched() and _several():
            _stop_all(error, traceback)
        raise


def _several() -> bool:
    """Return whether there are several processes that have begun to speak to each other."""
    mpi = sys.modules.get("mpi4py.MPI")
    return mpi is not None and mpi.COMM_WORLD.size > 1


def _stop_all(error: BaseException, traceback: bool) -> None:
    """Stop all ranks for an error of this one, unless all have one."""
    from mpi4py import MPI

    world = MPI.COMM_WORLD
    if world.size == 1 or _all_failed(world):
        return
    print(f"fabfem: rank {world.rank} of {world.size} failed: {error or type(error).__name__}", file=sys.stderr)
    if traceback:
        print_exc()
    sys.stderr.flush()
    world.Abort(2 if isinstance(error, ValueError) else 3)


def _all_failed(world: Any) -> bool:
    """Return whether all ranks come here within some time."""
    request, begun = (_team or world).Ibarrier(), monotonic()
    while monotonic() - begun < PATIENCE:
        if request.Test():
            return True
        sleep(0.01)
    return False
