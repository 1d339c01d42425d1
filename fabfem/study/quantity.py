"""The quantity of interest of a run, and how far it is from the truth."""

from collections.abc import Mapping, Sequence

import numpy as np

from fabfem.case.study import Quantity
from umat.mandel import Array

SAMPLES = 101
"""Places at which two curves are compared."""

Columns = Mapping[str, Sequence[str]]


class QuantityError(ValueError):
    """A history that does not have the quantity."""


def quantity_of(history: Columns, said: Quantity) -> Array:
    """Return the quantity of interest of a history: one number, or the (2, n) abscissae and ordinates of a curve.

    Raises
    ------
    QuantityError
        If the history does not have it, or does not reach it.
    """
    values = numbers(history, said.column, said.stage)
    if said.take == "curve":
        assert said.over is not None
        return np.array([numbers(history, said.over, said.stage), values])
    if said.take == "at":
        assert said.at is not None
        return np.array([reading(numbers(history, said.at.column, said.stage), values, said.at.value)])
    return np.array([{"last": values[-1], "largest": values.max(), "smallest": values.min()}[said.take]])


def numbers(history: Columns, name: str, stage: str | None = None) -> Array:
    """Return a column of a history as numbers, of one stage if that is named."""
    if name not in history:
        raise QuantityError(f"the history has no column '{name}'; it has {', '.join(history) or 'none'}")
    stages = history.get("stage", ())
    rows = [i for i in range(len(history[name])) if stage is None or stages[i] == stage]
    if not rows:
        raise QuantityError(f"the history has no row{f' of stage {stage}' if stage else ''}")
    try:
        return np.array([float(history[name][i]) for i in rows])
    except ValueError:
        raise QuantityError(f"column '{name}' does not hold numbers") from None


def reading(over: Array, values: Array, place: float) -> float:
    """Return the value where another column first passes a place, between rows along a straight line.

    Raises
    ------
    QuantityError
        If it never does.
    """
    before, after = over[:-1] - place, over[1:] - place
    passed = np.flatnonzero((before == 0.0) | (before * after < 0.0))
    slack = 1e-9 * max(float(np.abs(over).max()), abs(place))
    if len(passed):
        i = passed[0]
        share = before[i] / (before[i] - after[i]) if before[i] != after[i] else 0.0
        return float(values[i] + share * (values[i + 1] - values[i]))
    if abs(over[-1] - place) <= slack:
        return float(values[-1])
    raise QuantityError(f"no row reaches {place:g}; the column ends at {over[-1]:g}")


def distance(found: Array, truth: Array) -> float:
    """Return the error of a quantity, over the size of the truth; as it is where the truth is zero.

    The distance of two curves is the root of the mean square of the difference of their ordinates over the abscissae
    that both have, over the largest ordinate of the true one.
    """
    if found.ndim == 1:
        gap, size = abs(float(found[0] - truth[0])), abs(float(truth[0]))
        return gap / size if size > 0.0 else gap
    low, high = max(found[0].min(), truth[0].min()), min(found[0].max(), truth[0].max())
    along = np.linspace(low, high, SAMPLES)
    gap = float(np.sqrt(np.mean((_curve(found, along) - _curve(truth, along)) ** 2)))
    size = float(np.abs(truth[1]).max())
    return gap / size if size > 0.0 else gap


def _curve(curve: Array, along: Array) -> Array:
    """Return the ordinates at some abscissae; a curve that turns back is read in the order of its abscissae."""
    order = np.argsort(curve[0], kind="stable")
    return np.interp(along, curve[0][order], curve[1][order])
