"""Storage of a pool of lanes, and the constants that its kernels read."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..lanes import LANES, rows
from .contact import GROUP
from .rows import BUFFER, FACTOR, FRESH, OLD, ROWS, SHARE, VOID, Y

#: what a lane does next
IDLE, TRIAL, ITERATE, EQUILIBRIUM, CUT = (np.int64(k) for k in range(5))
#: what is counted in a lane
POINT, EVALUATIONS, SUBSTEPS, ITERATIONS, TRIES, CODE = (np.int64(k) for k in range(6))

Array = NDArray[np.float64]


class Constants(NamedTuple):
    """Dimensionless constants of a material and of its integration."""

    elastic: tuple[float, float, float]  #: compliance, 1/k_tR, 1/(2 k_pR)
    line: tuple[float, float, float]  #: e_ref, λ_c, ξ
    tan_mu: float
    total: bool
    evolving: bool
    tolerance: float
    max_evaluations: int
    open_pressure: float
    open_stiffness: float
    least_share: float


class Pool(NamedTuple):
    """What the lanes of one thread work on; N padded directions."""

    rows: Array  #: see `rows`
    slide: Array  #: sliding done, N rows, and at the end of the sub-step, N rows
    guess: Array  #: what the estimates of the sliding need, 6 N rows: of the accepted iterate 3, of the trial 3
    start: Array  #: normal force, its root and tangential force at the start of the sub-step, 5 N rows
    base: Array  #: forces at the start of the increment, 3 N rows, in the rate form
    buffer: Array  #: contributions of `GROUP` directions
    change: Array  #: (LANES, 13, 6) derivative of (σ, F, e) at the start of the sub-step by the increment
    dz: Array  #: (LANES, 9, 6) of Z
    dslide: Array  #: (LANES, N, 6) of the sliding
    carried: Array
    carried_fabric: Array
    new_change: Array
    small: Array  #: scratch, (10, 3, 3)
    long: Array  #: scratch, (28, 6)
    counts: NDArray[np.int64]  #: (6, LANES) point, evaluations, sub-steps, iterations, tries, code


def make_pool(n_directions: int, total: bool) -> Pool:
    """Return storage for `n_directions` padded directions, every lane at a harmless state."""
    n = n_directions
    pool = Pool(
        rows=rows(int(ROWS)), slide=rows(2 * n), guess=rows(6 * n), start=rows(5 * n), base=rows(3 if total else 3 * n),
        buffer=rows(int(GROUP * BUFFER)),
        change=np.zeros((LANES, 13, 6)), dz=np.zeros((LANES, 9, 6)), dslide=np.zeros((LANES, n, 6)),
        carried=np.zeros((12, 6)), carried_fabric=np.zeros((6, 6)), new_change=np.zeros((13, 6)),
        small=np.zeros((10, 3, 3)), long=np.zeros((28, 6)),
        counts=np.zeros((6, LANES), np.int64),
    )  # fmt: skip
    by_row = pool.rows.reshape(ROWS, LANES)
    by_row[SHARE] = by_row[FACTOR] = by_row[FRESH] = 1.0
    pool.guess[:] = 1.0
    pool.start[:] = 1.0
    for state in (Y, OLD):
        by_row[state : state + 3] = 1.0
        by_row[state + VOID] = 0.8
    return pool
