"""A sweep: the product of some parameters of a case, collected in one table, ``sweep.csv``.

Each run has its row, or with ``rows = "all"`` each row of its history: the parameters, how the run ended, what it took,
and the columns of the history, as ``NAME_history`` where a parameter has the name. A run that did not complete has its
row too. ``sweep.json`` says what the pictures need; where they show states, ``states.csv`` has them, and measured
curves come with ``measured.csv``.
"""

import csv
import json
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from io import StringIO
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple, TypeVar

from fabfem.case import Case, CaseError, read_case, read_tables, suggest
from fabfem.case.study import Sweep
from fabfem.outcome import claimed
from fabfem.output.atomic import write_atomic
from fabfem.output.history import read_history
from fabfem.study import compared, states
from fabfem.study.processes import Pool, limits
from fabfem.study.progress import shown, text
from fabfem.study.store import Plan, Run, name_of, runs
from fabfem.study.variants import choices

ABOUT = ("status", "reason", "wall_time [s]", "peak_memory [MiB]", "folder")
"""Columns that say how a run went."""

T = TypeVar("T")


class Swept(NamedTuple):
    """What a sweep has done."""

    table: Path
    """File of the table."""
    runs: int
    """Runs in it."""
    completed: int
    """Those that completed."""
    seconds: float
    """Processor time of all runs [s], those that were kept from before included."""

    @property
    def folder(self) -> Path:
        """Folder of the results."""
        return self.table.parent


def sweep(path: Path, folder: Path, quiet: bool = False, pool: Pool | None = None) -> Swept:
    """Run the sweep of a case file and return where its table is; runs that are there already are not repeated.

    Parameters
    ----------
    path : Path
        Case file.
    folder : Path
        Where the results go.
    quiet : bool
        Show no progress.
    pool : Pool, optional
        Processes to use; those that the case asks for by default.

    Raises
    ------
    CaseError
        If the case has no sweep, or one of its runs is no case.
    """
    case = read_case(path)
    said = asked(case, case.sweep, "sweep")
    wanted = choices(said.parameter)
    plan = Plan(read_tables(path), path, folder, wanted)
    done: dict[Any, Run] = {}
    with claimed(folder), nullcontext(pool) if pool else Pool(limits(said.workers, said.memory)) as processes:
        for run in shown(runs(plan, processes), len(wanted), quiet):
            done[run.choice] = run
            _write(folder / "sweep.csv", said, [done[choice] for choice in wanted if choice in done], case.path.name)
        in_order = [done[choice] for choice in wanted if choice in done]
        _conclude(case, said, in_order, folder)
    ended = [run.ran.status for run in in_order]
    seconds = sum(median(run.ran.cpu) for run in in_order if run.ran.cpu)
    return Swept(folder / "sweep.csv", len(ended), ended.count("completed"), seconds)


def _conclude(case: Case, said: Sweep, ended: Sequence[Run], folder: Path) -> None:
    """Write what takes all runs: states, comparisons, and what the pictures need."""
    passed = states.states(ended) if any(picture.states for picture in said.picture) else []
    if passed:
        write_atomic(folder / "states.csv", states.table(passed))
    if said.measured:
        file = case.locate(said.measured.data)
        compared.write(folder, said.measured, compared.measured_of(said.measured, ended, file, case.path.name))
    about = {
        "case": case.path.name,
        "title": case.title,
        "parameters": [parameter.name for parameter in said.parameter],
        "pictures": [picture.model_dump(mode="json") for picture in said.picture],
        "fits": states.fits(said, passed),
    }
    write_atomic(folder / "sweep.json", json.dumps(about, indent=1, ensure_ascii=False) + "\n")


def asked(case: Case, table: T | None, name: str) -> T:
    """Return a table of a case; `CaseError` if the case does not have it."""
    if table is None:
        raise CaseError(f"{case.path.name}: {name}: is missing; it says what is to be run")
    return table


def _write(table: Path, said: Sweep, ended: Sequence[Run], case: str) -> None:
    """Write the rows of the runs that have ended."""
    found = [(run, *_history(run)) for run in ended]
    headers = list(dict.fromkeys(header for _, known, _ in found for header in known))
    headers = headers if said.columns is None else [_header(name, headers, case) for name in said.columns]
    lines = StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    parameters = [parameter.name for parameter in said.parameter]
    writer.writerow(parameters + list(ABOUT) + [_beside(parameters, header) for header in headers])
    for run, known, rows in found:
        for row in _rows(rows, said):
            writer.writerow(
                [*_about(run), *(dict(zip(known, row, strict=False)).get(header, "") for header in headers)]
            )
    write_atomic(table, lines.getvalue())


def _history(run: Run) -> tuple[list[str], list[list[str]]]:
    file = run.folder / "history.csv"
    return read_history(file) if run.ran.status in ("completed", "stopped") and file.is_file() else ([], [])


def _rows(rows: Sequence[list[str]], said: Sweep) -> Iterator[list[str]]:
    """Yield the rows of a history that are wanted, an empty one where there is none."""
    if not rows:
        yield []
    yield from rows if said.rows == "all" else rows[-1:]


def _about(run: Run) -> list[Any]:
    seconds = f"{median(run.ran.wall):.3f}" if run.ran.wall else ""
    went = [run.ran.status, run.ran.reason, seconds, f"{run.ran.memory:.0f}", f"runs/{run.folder.name}"]
    return [*(text(setting.value) for setting in run.choice), *went]


def _beside(parameters: Sequence[str], header: str) -> str:
    """Return the header of a column of the histories, which a parameter of the same name leaves as NAME_history."""
    name = name_of(header)
    return f"{name}_history{header[len(name) :]}" if name in parameters else header


def _header(name: str, headers: Sequence[str], case: str) -> str:
    """Return the header of a column that was asked for by its name."""
    names = {name_of(header): header for header in headers}
    if headers and name not in names:
        raise CaseError(f"{case}: sweep.columns: no history has a column '{name}'{suggest(name, names)}")
    return names.get(name, name)
