"""Measured curves, and the residuals of a history against them."""

import csv
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fabfem.case import CaseError, suggest
from fabfem.case.study import Axis, Calibration, Comparison
from fabfem.study.quantity import Columns, numbers
from umat.mandel import Array


class Curves(NamedTuple):
    """What was measured in a test."""

    name: str
    """The values that tell its rows from the others."""
    along: Array
    """(n,) abscissae."""
    values: tuple[Array, ...]
    """(n,) ordinates of each curve."""


def measured_curves(said: Calibration, file: Path, case: str) -> list[Curves]:
    """Return the measured curves of each test.

    Raises
    ------
    CaseError
        If the file cannot be read, lacks a column, or has no row of a test.
    """
    rows = rows_of(file, f"{case}: calibration")
    return [
        curves_of(said, test.where, rows, f"{case}: calibration.test[{number}]")
        for number, test in enumerate(said.test, 1)
    ]


def rows_of(file: Path, place: str) -> list[dict[str, str]]:
    """Return the rows of a file of measured data by column; `CaseError` if it cannot be read."""
    try:
        lines = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        raise CaseError(f"{place}.data: {file.name} cannot be read ({error})") from None
    return list(csv.DictReader(lines))


def curves_of(said: Comparison, where: Mapping[str, object], rows: Sequence[Mapping[str, str]], place: str) -> Curves:
    """Return the measured curves in the rows whose columns have some values.

    Raises
    ------
    CaseError
        If a column is missing, holds something else than numbers, or fewer than two rows belong together.
    """
    known = list(rows[0]) if rows else []
    for column in (*where, said.over.data, *(curve.data for curve in said.curve)):
        if column not in known:
            raise CaseError(f"{place}: the data have no column '{column}'{suggest(column, known)}")
    mine = [row for row in rows if all(_equal(row[column], value) for column, value in where.items())]
    if len(mine) < 2:
        what = ", ".join(f"{column} = {value}" for column, value in where.items()) or "the test"
        raise CaseError(f"{place}.where: fewer than two rows of the data belong to the test ({what})")
    try:
        along, *values = (np.array([float(row[axis.data]) for row in mine]) for axis in (said.over, *said.curve))
    except ValueError as error:
        raise CaseError(f"{place}: the data hold something else than numbers ({error})") from None
    return Curves(", ".join(map(str, where.values())), along, tuple(values))


def curve_table(said: Comparison, tests: Sequence[tuple[Curves, Sequence[Array]]]) -> str:
    """Return the text of a table of measured curves and what answers them, a row for each measured point."""
    lines = StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    columns = [curve.data for curve in said.curve]
    writer.writerow(["test", said.over.data, *(f"{c} {w}" for c in columns for w in ("measured", "case"))])
    for measured, answered in tests:
        pairs = [part for pair in zip(measured.values, answered, strict=True) for part in pair]
        for row in zip(measured.along, *pairs, strict=True):
            writer.writerow([measured.name, *(f"{value:.6g}" for value in row)])
    return lines.getvalue()


def _equal(text: str, value: object) -> bool:
    """Return whether an entry of the data is a value of the case."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            return float(text) == float(value)
        except ValueError:
            return False
    return text.strip() == str(value)


def answers(said: Comparison, measured: Curves, history: Columns) -> tuple[Array, ...]:
    """Return (n,) what the history has at the abscissae of each measured curve; beyond its end, its last value.

    Raises
    ------
    QuantityError
        If the history lacks a column.
    """
    along = _read(said.over, history, said.stage)
    order = np.argsort(along, kind="stable")
    return tuple(
        np.interp(measured.along, along[order], _read(curve, history, said.stage)[order]) for curve in said.curve
    )


def _read(axis: Axis, history: Columns, stage: str | None) -> Array:
    values = axis.scale * numbers(history, axis.history, stage)
    return values / numbers(history, axis.divide_by, stage) if axis.divide_by else values


def residuals(said: Comparison, measured: Curves, answered: Sequence[Array]) -> Array:
    """Return the differences of all curves, each over the size of an error that counts as one."""
    parts = zip(said.curve, measured.values, answered, strict=True)
    return np.concatenate([(answer - value) / curve.error for curve, value, answer in parts])
