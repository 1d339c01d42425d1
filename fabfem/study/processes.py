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
from typing import NamedTuple

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


def run_all(jobs: Sequence[Job], allowed: Limits) -> Iterator[tuple[int, Ran]]:
    """Yield the number of each job and what became of it, as they end; leaving the loop ends all processes."""
    todo, idle = list(enumerate(jobs)), list[_Worker]()
    busy: dict[Connection, tuple[int, _Worker]] = {}
    try:
        while todo or busy:
            while todo and fits(todo[0][1].memory, [jobs[n].memory for n, _ in busy.values()], allowed):
                number, job = todo.pop(0)
                worker = idle.pop() if idle else _Worker(allowed.threads)
                worker.connection.send(job.task)
                busy[worker.connection] = number, worker
            for ready in wait(list(busy)):
                number, worker = busy.pop(ready)  # type: ignore[call-overload]
                answer = worker.answer()
                if worker.process.is_alive():
                    idle.append(worker)
                yield number, answer
    finally:
        for worker in (*idle, *(worker for _, worker in busy.values())):
            worker.end()


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
