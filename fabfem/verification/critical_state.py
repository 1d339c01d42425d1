"""One critical state: sheared far enough, sand with an evolving fabric has one stress ratio in all directions of shear.

The law of the fabric ends where F:n = F_c in every direction of loading [ZK 12–15], so q/p does not depend on α; with
the fabric frozen it does, by some 14 % (docs/element_tests.md). Undrained, e = 0.82, p0 = 100 kPa, b = 0.
"""

from collections.abc import Iterator
from time import perf_counter

import numpy as np

import umat
from fabfem.verification.chang_hicher import VERTICAL
from fabfem.verification.row import Row
from umat import mandel, path
from umat.directions import directions
from umat.sands import TOYOURA_FABRIC_NORM, toyoura

ANGLES = (0.0, 30.0, 60.0, 90.0)
"""Angle of the major stress with the deposition axis (α) [degrees]."""
SHEAR, RULE = 0.5, "gauss_16x20"


def rows() -> Iterator[Row]:
    """Yield q/p of every direction over their mean."""
    start = perf_counter()
    ratios = stress_ratios()
    seconds = perf_counter() - start
    mean = ratios.mean()
    for number, (angle, ratio) in enumerate(zip(ANGLES, ratios, strict=True)):
        note = f"ε1 − ε3 = {SHEAR:g}, {RULE}" if number == 0 else ""
        got = float(ratio) if np.isfinite(ratio) else None
        yield Row(f"q/p at α = {angle:g}°, mean of all", float(mean), got, 0.015, 0.0 if number else seconds, note)


def stress_ratios() -> np.ndarray:
    """Return q/p at the end of each direction of shear, NaN where it was not reached."""
    sand, rule = toyoura(), directions(RULE)
    legs = [path.undrained(SHEAR, angle) for angle in ANGLES]
    together = path.Leg(*(np.array(column) for column in zip(*legs, strict=True)))
    start = 100.0 * np.repeat(mandel.IDENTITY[None], len(ANGLES), axis=0)
    state = umat.initial_state(sand, rule, start, void_ratio=0.82, fabric=TOYOURA_FABRIC_NORM * VERTICAL)
    history = path.follow(sand, rule, state, together, 100)
    return np.where(history.reached == 1.0, mandel.eta(history.stress[-1]), np.nan)
