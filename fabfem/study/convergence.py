"""Orders of convergence, extrapolation to size zero, and the settings that are worth their time: pure functions.

With size h the error of a method of order p is C h^p once h is small; three sizes tell the value at h = 0, C and p.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from umat.mandel import Array

ROUNDING = 1e-13
"""Relative error below which rounding hides the order."""
ORDERS = (0.05, 12.0)
"""Orders that are looked for."""


class Extrapolated(NamedTuple):
    """The value at size zero, and how sure it is."""

    value: float
    order: float
    """Observed order; that which was expected where the sizes do not show one."""
    doubt: float
    """Distance that the truth may have from the value: that between it and the finest run."""
    sure: bool
    """Whether the three finest runs approach it from one side at a believable order."""


def observed_orders(sizes: ArrayLike, errors: ArrayLike) -> Array:
    """Return the (n - 1,) orders between neighbouring sizes, NaN where an error is lost in rounding."""
    h, e = np.asarray(sizes, float), np.asarray(errors, float)
    good = e > ROUNDING
    logs = np.log(np.where(good, e, 1.0))
    return np.where(good[1:] & good[:-1], np.diff(logs) / np.diff(np.log(h)), np.nan)


def fitted_order(sizes: ArrayLike, errors: ArrayLike) -> float:
    """Return the slope of the errors over the sizes, both logarithmic, of the finer half, three at least; NaN if none.

    Coarse runs are left out: they are not in the range where the order shows.
    """
    h, e = np.asarray(sizes, float), np.asarray(errors, float)
    good = np.flatnonzero(np.isfinite(e) & (e > ROUNDING))
    good = good[np.argsort(h[good])][: max(3, (len(good) + 1) // 2)]
    if len(good) < 2:
        return float("nan")
    return float(np.polyfit(np.log(h[good]), np.log(e[good]), 1)[0])


def richardson(sizes: Sequence[float], values: Sequence[float], expected: float = 2.0) -> Extrapolated:
    """Return the value at size zero that the three finest runs point to.

    Parameters
    ----------
    sizes, values : sequences of float
        Size and value of two runs at least.
    expected : float
        Order that is taken where the runs do not show one.

    Raises
    ------
    ValueError
        If there are fewer than two sizes.
    """
    order = np.argsort(np.asarray(sizes, float))
    h, f = np.asarray(sizes, float)[order], np.asarray(values, float)[order]
    if len(h) < 2 or h[0] == h[1]:
        raise ValueError("an extrapolation needs two sizes at least")
    shown = _order(h[:3], f[:3]) if len(h) > 2 else None
    p = expected if shown is None else shown
    value = f[0] + (f[0] - f[1]) / ((h[1] / h[0]) ** p - 1.0)
    return Extrapolated(float(value), p, abs(float(value - f[0])), shown is not None)


def _order(h: Array, f: Array) -> float | None:
    """Return the order p at which three values fit f + C h^p, if there is one within `ORDERS`."""
    from scipy.optimize import brentq

    near, far = f[0] - f[1], f[1] - f[2]
    if near == 0.0 or far == 0.0 or near * far < 0.0:
        return None

    def gap(p: float) -> float:
        return float(np.log((h[2] ** p - h[1] ** p) / (h[1] ** p - h[0] ** p)) - np.log(far / near))

    low, high = ORDERS
    return float(brentq(gap, low, high)) if gap(low) * gap(high) < 0.0 else None


def pareto(times: ArrayLike, errors: ArrayLike) -> NDArray[np.bool_]:
    """Return (n,) whether no other run is at least as good in time and error and better in one."""
    t, e = np.asarray(times, float), np.asarray(errors, float)
    finite = np.isfinite(t) & np.isfinite(e)
    better = (t[:, None] <= t) & (e[:, None] <= e) & ((t[:, None] < t) | (e[:, None] < e)) & finite[:, None]
    return finite & ~better.any(axis=0)


def cheapest(times: ArrayLike, errors: ArrayLike, largest: float) -> int | None:
    """Return the number of the quickest run whose error is at most `largest`, None if there is none."""
    t, e = np.asarray(times, float), np.asarray(errors, float)
    good = np.flatnonzero((e <= largest) & np.isfinite(t))
    return int(good[np.argmin(t[good])]) if len(good) else None
