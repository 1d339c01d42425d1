"""A routine under examination, what a check says, and how numbers are compared."""

from typing import Literal, NamedTuple

import numpy as np

from umat.external import External, ExternalState
from umat.interface import initial_state
from umat.mandel import Array

Verdict = Literal["good", "note", "bad"]
COUNT = 8
"""Strain increments that are tried."""
EXACT = 1e-9
"""Relative difference that is rounding."""


class Finding(NamedTuple):
    """What one check says."""

    verdict: Verdict
    """``good``, ``note`` for what a user must know, ``bad`` for what makes runs wrong."""
    sentence: str
    """One sentence."""


class Trial(NamedTuple):
    """A routine and where it is looked at."""

    material: External
    """The routine with its properties."""
    stress: Array
    """(6,) Mandel stress, compression positive."""
    size: float
    """Norm of the strain increments [-]."""

    def strains(self) -> Array:
        """Return (COUNT, 6) strain increments; a routine of four components gets none out of its plane."""
        random = np.random.default_rng(7)
        directions = random.normal(size=(COUNT, 6))
        if self.material.components == 4:
            directions[:, 3:5] = 0.0
        return self.size * directions / np.linalg.norm(directions, axis=1)[:, None]

    def state(self) -> ExternalState:
        """Return the state that all strains start from."""
        return initial_state(self.material, None, np.tile(self.stress, (COUNT, 1)))


def judged(good: bool, yes: str, no: str, otherwise: Verdict = "bad") -> Finding:
    """Return the finding of a check: a sentence if it is good, and another if it is not."""
    return Finding("good", f"{yes}.") if good else Finding(otherwise, f"{no}.")


def apart(left: Array, right: Array) -> float:
    """Return the largest difference over the largest number of either; infinite where a number is not finite."""
    if not (np.isfinite(left).all() and np.isfinite(right).all()):
        return np.inf
    size = max(np.abs(left).max(), np.abs(right).max())
    return float(np.abs(left - right).max() / size) if size else 0.0
