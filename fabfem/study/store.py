"""Runs that are kept, so that no run is repeated: a folder for each, named by a hash of all that decides its result.

That is the case with all its defaults, the content of the files that it names, and the sources of the program.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import fabfem
import umat
from fabfem.case import Case, case_from
from fabfem.output.atomic import write_atomic
from fabfem.output.history import name_and_unit, read_history
from fabfem.run import describe_case
from fabfem.study.processes import LEAST, Job, Pool
from fabfem.study.variants import ABOUT_RUNS, Choice, Tables, variant
from fabfem.study.worker import FINAL, Ran, Task

ASIDE = (
    *("__main__.py", "case/json_schema.py", "case/study.py", "cli.py", "commands", "extremes", "gallery.py"),
    *("pictures", "replay.py", "result.py", "starters", "study", "trace.py", "verification"),
)
"""Parts of the package that decide no result of a run."""


class Run(NamedTuple):
    """A run that has ended."""

    choice: Choice
    """Settings that it was made with."""
    folder: Path
    """Where its results are."""
    ran: Ran
    """What became of it."""

    def history(self) -> dict[str, list[str]]:
        """Return the columns of the history by name, without units; empty where there is none."""
        file = self.folder / "history.csv"
        if not file.is_file() or self.ran.status not in ("completed", "stopped"):
            return {}
        headers, rows = read_history(file)
        return {name_and_unit(header)[0]: [row[i] for row in rows] for i, header in enumerate(headers)}


class Plan(NamedTuple):
    """Runs of one case with several settings."""

    tables: Tables
    """The case as its file has it."""
    path: Path
    """Its file."""
    folder: Path
    """Where all results go."""
    choices: Sequence[Choice]
    """Settings of each run."""
    repeat: int = 1
    """Timings of each run."""


def runs(plan: Plan, pool: Pool) -> Iterator[Run]:
    """Yield the runs of a plan as they end; those that are kept from before come first, equal ones run once.

    Raises
    ------
    CaseError
        If one of the cases cannot be run; nothing has been run then.
    """
    jobs: dict[Path, Job] = {}
    wanted: dict[Path, list[Choice]] = {}
    for choice in plan.choices:
        task, memory = _task(plan, choice)
        kept = _kept(task)
        if kept:
            yield Run(choice, task.folder, kept)
        else:
            jobs[task.folder] = Job(task, memory)
            wanted.setdefault(task.folder, []).append(choice)
    todo = list(jobs.values())
    for number, ran in pool.run(todo):
        folder = todo[number].task.folder
        _keep(todo[number].task, ran)
        yield from (Run(choice, folder, ran) for choice in wanted[folder])


def _task(plan: Plan, choice: Choice) -> tuple[Task, float]:
    """Return the task of a choice, and the memory that it needs."""
    tables = variant(plan.tables, choice)
    case = case_from(tables, plan.path)
    folder = plan.folder / "runs" / run_key(case)
    memory = max(LEAST, describe_case(case).memory) if not (folder / "run.json").is_file() else LEAST
    return Task(tables, plan.path, folder, plan.repeat), memory


def run_key(case: Case) -> str:
    """Return the hash of all that decides the result of a case."""
    said = case.model_dump(mode="json", exclude=set(ABOUT_RUNS))
    digest = hashlib.sha256(json.dumps([said, sources()], sort_keys=True).encode())
    for file in _files(said, case):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def _files(said: Any, case: Case) -> Iterator[Path]:
    """Yield the files that a case names."""
    if isinstance(said, Mapping):
        said = list(said.values())
    if isinstance(said, list):
        for part in said:
            yield from _files(part, case)
    elif isinstance(said, str) and "." in said and case.locate(said).is_file():
        yield case.locate(said)


@cache
def sources() -> str:
    """Return a hash of the sources that decide a result."""
    digest = hashlib.sha256()
    for package in (umat, fabfem):
        root = Path(package.__file__ or "").parent
        for source in sorted(root.rglob("*.py")):
            place = source.relative_to(root)
            if place.parts[0] not in ASIDE and place.as_posix() not in ASIDE:
                digest.update(source.read_bytes())
    return digest.hexdigest()


def _kept(task: Task) -> Ran | None:
    """Return what became of a task before, if that is known and was timed as often as now wanted."""
    file = task.folder / "run.json"
    if not file.is_file():
        return None
    said = json.loads(file.read_text(encoding="utf-8"))
    ran = Ran(**(said | {clock: tuple(said[clock]) for clock in ("wall", "cpu")}))
    return ran if ran.status != "completed" or len(ran.wall) >= task.repeat else None


def _keep(task: Task, ran: Ran) -> None:
    if ran.status in FINAL:
        task.folder.mkdir(parents=True, exist_ok=True)
        write_atomic(task.folder / "run.json", json.dumps(ran._asdict(), indent=1) + "\n")
