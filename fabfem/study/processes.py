"""Tasks in parallel processes, as many at once as there are cores and memory for.

A process that is killed costs its run alone: the run is reported as killed and another process takes the next one.
"""

import multiprocessing
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from fabfem.study.worker import Ran, Task, serve, single_threaded

SHARE = 0.8
"""Share of the machine's free memory that runs may take together."""
LEAST = 250.0
"""Least memory that a run is taken to need [MiB]."""


class Limits(NamedTuple):
    """How much may go on at once."""

    workers: int
    """Processes."""
    threads: int
    """Threads of each process."""
    memory: float
    """Memory of all of them [MiB]."""


class Job(NamedTuple):
    """A task and the memory that it is expected to take [MiB]."""

    task: Task
    memory: float = LEAST


class _Worker:
    """A process, and the connection to it."""

    def __init__(self, threads: int) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        with _environment(single_threaded(threads)):
            self.process: SpawnProcess = context.Process(target=serve, args=(theirs, threads), daemon=True)
            self.process.start()
        theirs.close()

    def answer(self) -> Ran:
        """Return what became of the task, or that the process is gone."""
        try:
            return self.connection.recv()
        except (EOFError, OSError):
            self.process.join()
            code = self.process.exitcode or 0
            what = f"signal {-code}; memory may have run out" if code < 0 else f"exit status {code}"
            return Ran("killed", f"its process ended with {what}")

    def end(self) -> None:
        """End the process."""
        self.connection.close()
        self.process.terminate()
        self.process.join()


def limits(workers: int = 0, memory: float = 0.0) -> Limits:
    """Return the limits of this machine, less where a case asks for less.

    Parameters
    ----------
    workers : int
        Processes; 0 for one on each core.
    memory : float
        Memory of all [MiB]; 0 for what is free.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    workers = workers or cores
    return Limits(workers, max(1, cores // workers), memory or SHARE * free_memory())


def free_memory() -> float:
    """Return the memory that is free for new work [MiB], infinite where the system does not tell."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return float("inf")
    return float(next((line.split()[1] for line in lines if line.startswith("MemAvailable")), "inf")) / 1024.0


def fits(wanted: float, taken: Sequence[float], allowed: Limits) -> bool:
    """Return whether a job may begin beside those that run; a job on its own always may."""
    return not taken or (len(taken) < allowed.workers and wanted + sum(taken) <= allowed.memory)


class Pool:
    """Processes that stay between lists of jobs; leaving it ends them all."""

    def __init__(self, allowed: Limits) -> None:
        self.allowed = allowed
        self._idle: list[_Worker] = []
        self._busy: dict[Connection, tuple[int, _Worker]] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for worker in (*self._idle, *(worker for _, worker in self._busy.values())):
            worker.end()
        self._idle.clear()
        self._busy.clear()

    def run(self, jobs: Sequence[Job]) -> Iterator[tuple[int, Ran]]:
        """Yield the number of each job and what became of it, as they end."""
        todo = list(enumerate(jobs))
        while todo or self._busy:
            while todo and fits(todo[0][1].memory, [jobs[n].memory for n, _ in self._busy.values()], self.allowed):
                self._begin(*todo.pop(0))
            for ready in wait(list(self._busy)):
                yield self._ended(ready)  # type: ignore[arg-type]

    def _begin(self, number: int, job: Job) -> None:
        worker = self._idle.pop() if self._idle else _Worker(self.allowed.threads)
        worker.connection.send(job.task)
        self._busy[worker.connection] = number, worker

    def _ended(self, ready: Connection) -> tuple[int, Ran]:
        number, worker = self._busy.pop(ready)
        answer = worker.answer()
        if worker.process.is_alive():
            self._idle.append(worker)
        return number, answer


@contextmanager
def _environment(changes: dict[str, str]) -> Iterator[None]:
    """Have other variables in the environment for a while."""
    before = {name: os.environ.get(name) for name in changes}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})
