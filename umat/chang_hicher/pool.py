"""Storage of a pool of lanes, and the constants that a kernel reads."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..fabric.law import INPUTS
from ..lanes import LANES, rows
from .balance import GEOMETRY_ROWS, STATE_ROWS
from .contact import GROUP, PLANE_ROWS
from .programs import BUFFER_ROWS, COLUMNS, SUM_ROWS

Array = NDArray[np.float64]
RHS = 8  #: right-hand sides: the Newton step, six columns of the tangent, the error


class Constants(NamedTuple):
    """Dimensionless constants of a material and of its integration."""

    elastic: tuple[float, float, float, float]
    line: tuple[float, float, float]
    tan_mu: float
    total: bool
    evolving: bool
    tolerance: float
    max_evaluations: int


class Rule(NamedTuple):
    """Contact directions, padded with weightless ones to whole groups."""

    normals: Array
    weights: Array
    table: Array


class Pool(NamedTuple):
    """Rows of all lanes; see the kernels that use them."""

    y: Array  #: trial state: stress, fabric, void ratio
    accepted: Array
    step: Array
    old: Array  #: start of the sub-step
    full: Array  #: strain increment asked for
    strain: Array  #: strain increment of the sub-step
    work: Array
    place: Array
    sums: Array
    buffer: Array
    scratch: Array
    strains: Array  #: the sub-step's strain, its plastic part and its first-order part, 18 rows
    slope: Array
    plastic_slope: Array
    geo: Array
    inputs: Array
    gain: Array
    gain_end: Array
    law_slope: Array
    ratio_slope: Array
    ratio_old: Array
    fabric_slope: Array
    matrix: Array
    rhs: Array
    pivot: Array
    sliding: Array
    sliding_new: Array
    base: Array
    change: Array
    dz: Array
    dslide: Array
    carried: Array
    carried_fabric: Array
    new_change: Array
    number: Array  #: per lane: fraction done, size, line search factor, residual, error, void ratio at the start
    count: NDArray[np.int64]  #: per lane: point, evaluations, sub-steps, iterations, tries, code


def make_pool(n_directions: int, total: bool) -> Pool:
    """Return storage for a pool whose rule has `n_directions` (padded) directions."""
    n = n_directions
    return Pool(
        y=rows(STATE_ROWS), accepted=rows(STATE_ROWS), step=rows(STATE_ROWS), old=rows(STATE_ROWS), full=rows(6),
        strain=rows(6), work=rows(PLANE_ROWS), place=rows(GEOMETRY_ROWS), sums=rows(SUM_ROWS),
        buffer=np.zeros((GROUP, BUFFER_ROWS, LANES)), scratch=rows(180), strains=rows(18), slope=rows(6 * COLUMNS),
        plastic_slope=rows(6 * COLUMNS), geo=rows(72), inputs=rows(INPUTS), gain=rows(6), gain_end=rows(6),
        law_slope=rows(6 * INPUTS), ratio_slope=rows(36), ratio_old=rows(36), fabric_slope=rows(6 * COLUMNS),
        matrix=rows(144), rhs=rows(12 * RHS), pivot=np.zeros(LANES), sliding=rows(n), sliding_new=rows(n),
        base=rows(3 if total else 3 * n), change=np.zeros((LANES, 13, 6)), dz=np.zeros((LANES, 9, 6)),
        dslide=np.zeros((LANES, n, 6)), carried=np.zeros((12, 6)), carried_fabric=np.zeros((6, 6)),
        new_change=np.zeros((13, 6)), number=rows(6), count=np.zeros((6, LANES), np.int64),
    )  # fmt: skip
