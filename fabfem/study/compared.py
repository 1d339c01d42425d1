"""Measured curves beside the runs of a sweep: ``measured.csv`` with the differences, ``measured_curves.csv`` with both.

A measured point beyond the end of a run is left out.
"""

import csv
from collections.abc import Iterator, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from fabfem.case import CaseError
from fabfem.case.study import MeasuredRuns
from fabfem.output.atomic import write_atomic
from fabfem.study.measured import Curves, answers, curve_table, curves_of, rows_of
from fabfem.study.quantity import QuantityError, numbers
from fabfem.study.store import Run
from umat.mandel import Array

Answered = tuple[Curves, tuple[Array, ...]]


def measured_of(said: MeasuredRuns, runs: Sequence[Run], file: Path, case: str) -> list[Answered]:
    """Return the measured curves of each run that has a history, and what answers them.

    Raises
    ------
    CaseError
        If the file cannot be read, a column is missing, or no row belongs to a run.
    """
    place = f"{case}: sweep.measured"
    rows = rows_of(file, place)
    return [_answered(said, run, rows, place) for run in runs if run.history()]


def _answered(said: MeasuredRuns, run: Run, rows: Sequence[dict[str, str]], place: str) -> Answered:
    values = {setting.name: setting.value for setting in run.choice}
    whole = curves_of(said, {column: values[name] for column, name in said.where.items()}, rows, place)
    try:
        reached = whole.along <= np.max(said.over.scale * numbers(run.history(), said.over.history, said.stage))
        measured = Curves(whole.name, whole.along[reached], tuple(curve[reached] for curve in whole.values))
        return measured, answers(said, measured, run.history())
    except QuantityError as error:
        raise CaseError(f"{place}: {error}") from None


def write(folder: Path, said: MeasuredRuns, found: Sequence[Answered]) -> None:
    """Write both tables."""
    write_atomic(folder / "measured_curves.csv", curve_table(said, found))
    lines = StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(["test", "curve", "points", "root_mean_square", "largest"])
    writer.writerows(differences(said, found))
    write_atomic(folder / "measured.csv", lines.getvalue())


def differences(said: MeasuredRuns, found: Sequence[Answered]) -> Iterator[list[Any]]:
    """Yield test, curve, points, root mean square and largest difference; then those of all tests together."""
    for number, curve in enumerate(said.curve):
        gaps = {measured.name: answered[number] - measured.values[number] for measured, answered in found}
        together = {"all": np.concatenate(list(gaps.values()))} if gaps else {}
        for name, gap in (*gaps.items(), *together.items()):
            if len(gap):
                spread = float(np.sqrt(np.mean(gap**2)))
                yield [name, curve.data, len(gap), f"{spread:.4g}", f"{np.abs(gap).max():.4g}"]
