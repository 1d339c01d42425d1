"""Measured curves, and the residuals of a history against them."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fabfem.case import CaseError, suggest
from fabfem.case.study import Axis, Calibration, Measured
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
    rows = _rows(file, case)
    return [_curves(said, test, number, rows, case) for number, test in enumerate(said.test, 1)]


def _rows(file: Path, case: str) -> list[dict[str, str]]:
    try:
        lines = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        raise CaseError(f"{case}: calibration.data: {file.name} cannot be read ({error})") from None
    return list(csv.DictReader(lines))


def _curves(said: Calibration, test: Measured, number: int, rows: Sequence[Mapping[str, str]], case: str) -> Curves:
    place = f"{case}: calibration.test[{number}]"
    known = list(rows[0]) if rows else []
    for column in (*test.where, said.over.data, *(curve.data for curve in said.curve)):
        if column not in known:
            raise CaseError(f"{case}: calibration: the data have no column '{column}'{suggest(column, known)}")
    mine = [row for row in rows if all(_equal(row[column], value) for column, value in test.where.items())]
    if len(mine) < 2:
        raise CaseError(f"{place}.where: fewer than two rows of the data belong to the test")
    try:
        along, *values = (np.array([float(row[axis.data]) for row in mine]) for axis in (said.over, *said.curve))
    except ValueError as error:
        raise CaseError(f"{place}: the data hold something else than numbers ({error})") from None
    name = ", ".join(str(value) for value in test.where.values()) or f"test {number}"
    return Curves(name, along, tuple(values))


def _equal(text: str, value: bool | int | float | str) -> bool:
    """Return whether an entry of the data is a value of the case."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            return float(text) == float(value)
        except ValueError:
            return False
    return text.strip() == str(value)


def answers(said: Calibration, measured: Curves, history: Columns) -> tuple[Array, ...]:
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


def residuals(said: Calibration, measured: Curves, answered: Sequence[Array]) -> Array:
    """Return the differences of all curves, each over the size of an error that counts as one."""
    parts = zip(said.curve, measured.values, answered, strict=True)
    return np.concatenate([(answer - value) / curve.error for curve, value, answer in parts])
