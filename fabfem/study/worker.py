"""A process that runs cases one after the other, each as often as its time is wanted.

It stays alive between runs, so that the time of a run holds neither the start of the interpreter nor the loading of
compiled kernels, except where it is the first of its kind in the process: the median of three timings leaves that out.
"""

import os
import signal
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

FINAL = ("completed", "stopped", "refused")
"""Ends of a run that it would come to again; others are worth another try."""


class Task(NamedTuple):
    """A case to run."""

    tables: dict[str, Any]
    """The case."""
    path: Path
    """File beside which the case names its files."""
    folder: Path
    """Where its results go."""
    repeat: int = 1
    """Timings."""


class Ran(NamedTuple):
    """What became of a task."""

    status: str
    """``completed``, ``stopped``, ``refused`` (no case that can be run), ``failed`` or ``killed``."""
    reason: str
    """Why, in a sentence; empty when completed."""
    wall: tuple[float, ...] = ()
    """Wall time of each repetition [s]."""
    cpu: tuple[float, ...] = ()
    """Processor time of each repetition, of all threads [s]."""
    memory: float = 0.0
    """Largest memory of the process during the runs [MiB]."""


def serve(connection: Connection, threads: int) -> None:
    """Answer each task that arrives with what became of it, until the other end closes.

    Parameters
    ----------
    connection : Connection
        Where tasks come from and answers go to.
    threads : int
        Threads for the material points of a case that asks for no number of its own.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    from umat import set_threads

    with suppress(EOFError, BrokenPipeError):
        while True:
            task = connection.recv()
            set_threads(threads)
            connection.send(perform(task))


def perform(task: Task) -> Ran:
    """Return what becomes of a task; nothing is raised."""
    from fabfem.case import CaseError, case_from
    from fabfem.output.report import peak_memory

    forget_peak_memory()
    wall: list[float] = []
    cpu: list[float] = []
    try:
        case = case_from(task.tables, task.path)
        status, reason = "completed", ""
        while len(wall) < task.repeat and status == "completed":
            status, reason = _timed(case, task.folder, wall, cpu)
    except CaseError as error:
        return Ran("refused", str(error))
    except Exception as error:
        return Ran("failed", f"{type(error).__name__}: {error}")
    return Ran(status, reason, tuple(wall), tuple(cpu), peak_memory())


def _timed(case: Any, folder: Path, wall: list[float], cpu: list[float]) -> tuple[str, str]:
    """Run a case, note its times, and return how it ended and why."""
    from fabfem.run import run_case

    begun = time.process_time()
    outcome = run_case(case, folder, quiet=True)
    cpu.append(time.process_time() - begun)
    wall.append(outcome.seconds)
    return outcome.status, outcome.reason


def forget_peak_memory() -> None:
    """Let the largest memory of this process count from now on, where the system can forget it (Linux)."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def single_threaded(threads: int) -> dict[str, str]:
    """Return the environment in which numerical libraries take a number of threads."""
    names = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    return {name: os.environ.get(name, str(threads)) for name in names}
