"""Element paths of the Chang–Hicher model against curves of an independent prototype, one row per cent of strain.

The prototype is another implementation of the same equations, with 384 directions (Gauss 24 × 32) and steps small
enough for 0.5 kPa; here the same directions are taken. Of all per cents, a quantity's row is the one furthest off.
"""

from collections.abc import Callable, Iterator
from importlib.resources import files
from time import perf_counter

import numpy as np

import umat
from fabfem.verification.row import Row
from umat import mandel, path
from umat.directions import directions
from umat.sands import TOYOURA_FABRIC_NORM, toyoura

CURVES: dict[str, tuple[str, float, Callable[[float], path.Leg]]] = {
    "drained triaxial compression": ("drained_tc", 0.80, path.triaxial),
    "undrained, α = 0": ("undrained_a0", 0.833, path.undrained),
    "undrained, α = 45°": ("undrained_a45", 0.833, lambda strain: path.undrained(strain, alpha=45.0)),
}
"""Name -> file of the prototype, void ratio, leg to a strain."""
COLUMNS = {"p [kPa]": (1, 0.01), "q [kPa]": (2, 0.01), "e": (3, 0.01), "‖F‖": (4, 0.01)}
"""Quantity -> column of the file, relative tolerance."""
EACH = 10
"""Records for each row of a file."""
VERTICAL = np.array([-1.0, -1.0, 2.0, 0.0, 0.0, 0.0]) / 6.0**0.5
"""Unit fabric of a deposit."""


def rows() -> Iterator[Row]:
    """Yield p, q, e and ‖F‖ of every curve."""
    for name in CURVES:
        yield from curve(name)


def curve(name: str, rule: str = "gauss_24x32") -> Iterator[Row]:
    """Yield the rows of one curve."""
    start = perf_counter()
    file, void_ratio, leg = CURVES[name]
    theirs = prototype(file)
    ours = path_columns(rule, void_ratio, leg(theirs[-1, 0]), len(theirs))
    seconds = perf_counter() - start
    for number, (quantity, (column, tolerance)) in enumerate(COLUMNS.items()):
        worst = int(np.nanargmax(np.abs(ours[:, column] / theirs[:, column] - 1.0)))
        got = float(ours[worst, column]) if np.isfinite(ours[:, column]).all() else None
        note = f"of {len(theirs)} rows, {rule}" if number == 0 else ""
        where = f"{quantity} at {100.0 * theirs[worst, 0]:.0f} %, {name}"
        yield Row(where, float(theirs[worst, column]), got, tolerance, 0.0 if number else seconds, note)


def prototype(file: str) -> np.ndarray:
    """Return strain, p [kPa], q [kPa], e and ‖F‖ (n, 5) of a curve of the prototype."""
    with (files("fabfem.verification") / "prototype" / f"{file}.csv").open(encoding="utf-8") as lines:
        return np.loadtxt(lines, delimiter=",", skiprows=3, ndmin=2)


def path_columns(rule: str, void_ratio: float, leg: path.Leg, count: int) -> np.ndarray:
    """Return the same columns (count, 5) of Toyoura sand along a leg, NaN where the path has ended; no strain."""
    sand, normals = toyoura(), directions(rule)
    state = umat.initial_state(
        sand, normals, 100.0 * mandel.IDENTITY[None], void_ratio=void_ratio, fabric=TOYOURA_FABRIC_NORM * VERTICAL
    )
    history = path.follow(sand, normals, state, leg, EACH * count)
    kept = slice(EACH, None, EACH)
    stress, fabric = history.stress[kept, 0], history.fabric[kept, 0]
    e = history.void_ratio[kept, 0]
    return np.stack([np.zeros(count), mandel.p(stress), mandel.q(stress), e, mandel.norm(fabric)], axis=1)
