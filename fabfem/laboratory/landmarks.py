"""States of a test that have names: instability, phase transformation, characteristic, peak and critical state.

Found among the rows of a stage up to its first reversal, each at the vertex of the parabola through the three rows
around an extremum, over the path length of strain; whatever else is said of the state is interpolated between the rows
on either side. An extremum counts where the curve comes back from it by more than `NOTICED` of its largest value.

* Instability, at constant volume: the first maximum of q that is followed by a fall.
* Phase transformation, at constant volume: the first minimum of p that is followed by a rise.
* Characteristic state, drained: the first maximum of ε_v, from contraction to dilation.
* Peak: the largest stress ratio q/p, if it is followed by a fall.
* Loss of second-order work: the first row whose Δσ:Δε since the row before is negative.
* Critical state: the first row from which on q, p, e (or ε_v) and ‖F‖ stay within `STEADY` of their last values for a
  deviatoric strain of at least `LONG`. A liquefied state, with next to no stress, is none.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from umat.mandel import Array, eta, norm, p, q, trace
from umat.measures import deviatoric_strain, dot

NOTICED = 1e-3
STEADY = 0.01
LONG = 0.1
CONSTANT_VOLUME = 1e-9


class Rows(NamedTuple):
    """The rows of a stage as arrays."""

    stress: Array
    """(m, 6)."""
    strain: Array
    """(m, 6) of the stage."""
    void_ratio: Array
    """(m,) NaN without."""
    fabric_norm: Array
    """(m,) NaN without."""
    ending: bool = True
    """Whether the stage ended with some stress left: not liquefied."""

    @property
    def way(self) -> Array:
        """Path length of strain (m,)."""
        return np.concatenate([[0.0], np.cumsum(norm(np.diff(self.strain, axis=0)))])

    @property
    def constant_volume(self) -> bool:
        """Whether the stage keeps its volume."""
        return bool(np.abs(trace(self.strain) - trace(self.strain[0])).max() < CONSTANT_VOLUME)


def landmarks(rows: Rows) -> dict[str, float]:
    """Return the place of each state that the stage passes, as a row number with a fraction."""
    if len(rows.stress) < 3:
        return {}
    found = {name: search(rows) for name, search in SEARCHES.items()}
    return {name: place for name, place in found.items() if place is not None}


def interpolated(values: Array, place: float) -> Array:
    """Return the values (m, ...) at a place between two rows, linearly."""
    low = min(int(place), len(values) - 1)
    high = min(low + 1, len(values) - 1)
    return np.asarray((1.0 - (place - low)) * values[low] + (place - low) * values[high], dtype=float)


def first_maximum(values: Array, way: Array) -> float | None:
    """Return the place of the first maximum within a curve that it comes back from, or ``None``."""
    noticed = NOTICED * np.abs(values).max()
    top = 0
    for row in range(1, len(values)):
        if values[row] > values[top]:
            top = row
        elif top > 0 and values[top] - values[row] > noticed:
            return vertex(values, way, top)
    return None


def vertex(values: Array, way: Array, row: int) -> float:
    """Return the place of the vertex of the parabola through a row that is an extremum and its two neighbours."""
    if not 0 < row < len(values) - 1:
        return float(row)
    left, right = way[row] - way[row - 1], way[row + 1] - way[row]
    if not (left > 0.0 and right > 0.0):
        return float(row)
    rise, fall = (values[row] - values[row - 1]) / left, (values[row + 1] - values[row]) / right
    if fall == rise:
        return float(row)
    move = 0.5 * (rise * (left + right) / (rise - fall) - left)  # where the slope, linear between them, vanishes
    move = float(np.clip(move, -left, right))
    return row + (move / right if move > 0.0 else move / left)


def _instability(rows: Rows) -> float | None:
    return first_maximum(q(rows.stress), rows.way) if rows.constant_volume else None


def _transformation(rows: Rows) -> float | None:
    return first_maximum(-p(rows.stress), rows.way) if rows.constant_volume else None


def _characteristic(rows: Rows) -> float | None:
    volume = trace(rows.strain)
    return None if rows.constant_volume else first_maximum(volume - volume[0], rows.way)


def _peak(rows: Rows) -> float | None:
    ratio = eta(rows.stress)
    top = int(np.nanargmax(np.where(np.isfinite(ratio), ratio, -1.0)))
    after = ratio[top:]
    falls = top > 0 and ratio[top] > NOTICED and float(ratio[top] - np.nanmin(after)) > NOTICED * ratio[top]
    return vertex(ratio, rows.way, top) if falls else None


def _lost_work(rows: Rows) -> float | None:
    work = dot(np.diff(rows.stress, axis=0), np.diff(rows.strain, axis=0))
    lost: NDArray[np.intp] = np.flatnonzero(work < 0.0)
    return float(lost[0] + 1) if lost.size else None


def _critical(rows: Rows) -> float | None:
    volume = rows.void_ratio if np.isfinite(rows.void_ratio).all() else 1.0 + trace(rows.strain)
    curves = [q(rows.stress), p(rows.stress), volume]
    curves += [rows.fabric_norm] if np.isfinite(rows.fabric_norm).all() else []
    near = np.all([np.abs(curve - curve[-1]) <= STEADY * abs(curve[-1]) for curve in curves], axis=0)
    first = len(near) - int(np.argmin(near[::-1])) if not near.all() else 0
    sheared = deviatoric_strain(rows.strain)
    long = first < len(near) and sheared[-1] - sheared[first] >= LONG
    return float(first) if rows.ending and long and q(rows.stress)[-1] > 0.0 else None


SEARCHES: dict[str, Callable[[Rows], float | None]] = {
    "instability": _instability,
    "phase_transformation": _transformation,
    "characteristic": _characteristic,
    "peak": _peak,
    "second_order_work_lost": _lost_work,
    "critical": _critical,
}
"""Search for each state."""
