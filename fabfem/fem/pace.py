"""How fast the pore pressure may change: the local error of the time steps of a stage where water flows."""

from typing import NamedTuple

import numpy as np

from fabfem.fem.pores import Water


class Flowed(NamedTuple):
    """What the error of the next time step is judged by."""

    rate: np.ndarray | None = None
    """Rate of the pressures in the last step, per stage; None before a first."""
    largest: float = 0.0
    """Largest pressure so far [stress]."""


class Pace:
    """The error of the time steps of a stage where water flows, over what the stage allows."""

    def __init__(self, water: Water | None, tolerance: float) -> None:
        self._water = water if water is not None and water.seepage is not None and tolerance > 0.0 else None
        self._tolerance = tolerance

    def error(self, past: Flowed, start: np.ndarray, step: np.ndarray, size: float) -> float:
        """The local error of backward Euler, Δt/2 |ṗ − ṗ_last| over the largest pressure so far, over the tolerance.

        `start` and `step` are unknowns (ndof,), `size` is the part of the stage. It is 0 before a second step.
        """
        if self._water is None or past.rate is None:
            return 0.0
        pressures = slice(self._water.nmotion, None)
        largest = max(past.largest, self._most(start[pressures]))
        change = self._most(step[pressures] / size - past.rate)
        return float(0.5 * size * change / (largest * self._tolerance)) if largest > 0.0 else 0.0

    def after(self, past: Flowed, start: np.ndarray, step: np.ndarray, size: float) -> Flowed:
        """What the next step is judged by once a step is done."""
        if self._water is None:
            return past
        pressures = slice(self._water.nmotion, None)
        return Flowed(step[pressures] / size, max(past.largest, self._most(start[pressures])))

    def _most(self, pressures: np.ndarray) -> float:
        assert self._water is not None
        return self._water.space.mesh.ranks.largest(float(np.abs(pressures).max(initial=0.0)))
