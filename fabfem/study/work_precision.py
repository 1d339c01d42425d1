"""Error against run time: what each setting of a case costs and buys.

A study turns knobs, takes the quantity of interest of each run, and measures it against the truth. It leaves
``study.csv`` with a row for each run, ``study.json`` with the orders and the sentences, and the runs themselves, which
no later study of the same case repeats.
"""

import csv
import json
from collections.abc import Iterator, Sequence
from io import StringIO
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from fabfem.case import Case, read_case, read_tables
from fabfem.case.study import Study
from fabfem.outcome import claimed
from fabfem.output.atomic import write_atomic
from fabfem.study.convergence import pareto
from fabfem.study.processes import Pool, limits
from fabfem.study.progress import label, shown, text
from fabfem.study.quantity import QuantityError, distance, quantity_of
from fabfem.study.store import Plan, Run, runs
from fabfem.study.sweep import asked
from fabfem.study.truth import Known, Values, finest, knob_named, truth
from fabfem.study.variants import Choice, choices, one_at_a_time, settings_of
from fabfem.study.verdict import Measured, orders, sentences, standing
from umat.mandel import Array

HEADERS = (
    *("error", "wall_time [s]", "cpu_time [s]", "timings", "peak_memory [MiB]"),
    *("pareto", "status", "reason", "folder"),
)
"""Columns of ``study.csv`` after those of the knobs and of the quantity."""


class Studied(NamedTuple):
    """What a study found."""

    folder: Path
    """Where ``study.csv`` and ``study.json`` are."""
    sentences: tuple[str, ...]
    """What it comes to."""


def study(path: Path, folder: Path, quiet: bool = False) -> Studied:
    """Run the study of a case file and write what it found; runs that are there already are not repeated.

    Raises
    ------
    CaseError
        If the case has no study, one of its runs is no case, or the truth cannot be told.
    """
    case = read_case(path)
    said = asked(case, case.study, "study")
    if said.truth is not None and said.truth.richardson is not None:
        knob_named(said, said.truth.richardson, path.name)
    wanted = wanted_choices(said)
    plan = Plan(read_tables(path), path, folder, wanted, said.repeat)
    with claimed(folder):
        with Pool(limits(said.workers, said.memory)) as pool:
            found = {run.choice: run for run in shown(runs(plan, pool), len(wanted), quiet)}
        values, troubles = _values(said, found)
        known = truth(said, values, path.name)
        rows = [_measured(found[choice], values, known, troubles) for choice in _listed(said, wanted)]
        return _write(case, said, folder, rows, known, values)


def wanted_choices(said: Study) -> list[Choice]:
    """Return the settings of all runs: the knobs' own, the case as it stands, each knob alone at its last value."""
    turned = one_at_a_time(said.knob) if said.turn == "one_at_a_time" else choices(said.knob)
    alone: list[Choice] = [(settings_of(knob)[-1],) for knob in said.knob]
    fine = [] if said.truth is not None and said.truth.reference is None else [finest(said)]
    if said.truth is not None and said.truth.richardson is not None:
        alone += [c for c in one_at_a_time(said.knob) if c and c[0].name == said.truth.richardson]
    return list(dict.fromkeys([(), *turned, *alone, *fine]))


def _listed(said: Study, wanted: Sequence[Choice]) -> list[Choice]:
    """Return the runs that are listed and drawn: not the one that only says what is true."""
    only_truth = said.turn == "one_at_a_time" or (said.truth is not None and said.truth.reference is not None)
    return [choice for choice in wanted if not (only_truth and choice == finest(said) and len(choice) > 1)]


def _values(said: Study, found: dict[Choice, Run]) -> tuple[dict[Choice, Array], dict[Choice, str]]:
    """Return the quantity of interest of each run that has it, and why the others do not."""
    values: dict[Choice, Array] = {}
    troubles: dict[Choice, str] = {}
    for choice, run in found.items():
        try:
            value = quantity_of(run.history(), said.quantity)
            if said.quantity.take == "last" and run.ran.status != "completed":
                raise QuantityError("the last row is not that of a completed run")
            values[choice] = value
        except QuantityError as error:
            troubles[choice] = run.ran.reason or str(error)
    return values, troubles


def _measured(run: Run, values: Values, known: Known, troubles: dict[Choice, str]) -> Measured:
    value = values.get(run.choice)
    error = float("nan") if value is None else distance(value, known.value)
    wall, cpu = (median(times) if times else float("nan") for times in (run.ran.wall, run.ran.cpu))
    return Measured(run, value, error, wall, cpu, troubles.get(run.choice, run.ran.reason))


def _write(case: Case, said: Study, folder: Path, rows: Sequence[Measured], known: Known, values: Values) -> Studied:
    front = pareto([row.time(said.clock) for row in rows], [row.error for row in rows])
    lines = StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow([*(knob.name for knob in said.knob), said.quantity.column, *HEADERS])
    for row, best in zip(rows, front, strict=True):
        writer.writerow([*_settings(said, row.run.choice), *_numbers(row), int(best), *_end(row)])
    write_atomic(folder / "study.csv", lines.getvalue())
    found = tuple(sentences(said, rows, known, values))
    own = standing(said, rows, values)
    content = {
        "case": case.path.name,
        "title": case.title,
        "quantity": said.quantity.model_dump(exclude_none=True),
        "truth": {"value": known.value.tolist(), "doubt": known.doubt, "how": known.how},
        "clock": said.clock,
        "turn": said.turn,
        "orders": [order._asdict() for order in orders(said, rows, values)],
        "rows": [_drawn(row, said, bool(best)) for row, best in zip(rows, front, strict=True)],
        "sentences": found,
        "standing": own._asdict() if own else None,
    }
    write_atomic(folder / "study.json", json.dumps(_finite(content), indent=1) + "\n")
    return Studied(folder, found)


def _settings(said: Study, choice: Choice) -> Iterator[str]:
    """Yield the value of each knob that is turned in a run, nothing where it stands as the case has it."""
    chosen = {setting.name: text(setting.value) for setting in choice}
    yield from (chosen.get(knob.name, "") for knob in said.knob)


def _numbers(row: Measured) -> tuple[Any, ...]:
    value = "" if row.value is None else "curve" if row.value.ndim > 1 else repr(float(row.value[0]))
    times = (f"{row.wall:.4f}", f"{row.cpu:.4f}", len(row.run.ran.wall))
    return (value, f"{row.error:.6g}", *times, f"{row.run.ran.memory:.0f}")


def _end(row: Measured) -> tuple[str, ...]:
    return (row.run.ran.status, row.trouble, f"runs/{row.run.folder.name}")


def _drawn(row: Measured, said: Study, best: bool) -> dict[str, Any]:
    """Return what the picture needs of a run."""
    names = [setting.name for setting in row.run.choice]
    knob = names[0] if len(names) == 1 else ""
    return {
        "label": label(row.run.choice),
        "setting": label(row.run.choice) if row.run.choice else "",
        "knob": knob,
        "value": text(row.run.choice[0].value) if knob else "",
        "time": row.time(said.clock),
        "error": row.error,
        "pareto": best,
    }


def _finite(content: Any) -> Any:
    """Return content with None for what JSON cannot hold."""
    if isinstance(content, dict):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not np.isfinite(content) else content
