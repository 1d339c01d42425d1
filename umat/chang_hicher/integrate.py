"""Integration of many points over their strain increments: a pool of lanes, each at its own place in its own point.

A round evaluates residual and Jacobian at the trial state of every lane at once; then each lane decides by itself:

* `iteration`: inside the domain, take the next Newton step; outside, come back;
* `substeps`: in equilibrium, compare with backward Euler (embedded, first order), accept the sub-step or cut it;
* `points`: at the end of its increment, write the answer and take the next point; under the open pressure, the
  packing has opened and the rest of the increment is a gap; out of means, a status code, nothing written.
"""

import numpy as np

from ..fabric.law import active_inputs, increments
from ..lanes import LANES, entry, kernel, spot
from .balance import friction_columns, geometry, strain_and_slope
from .contact import sum_planes
from .elimination import factorise, solve
from .history import assign
from .iteration import judge
from .points import load
from .pool import CODE, EQUILIBRIUM, IDLE, TRIAL
from .residual import by_ratio, error_norms, fabric_rows, gather, law_inputs, norms, right_hand_sides
from .rows import (
    D_SLIPPED,
    ERRORS,
    FRACTION,
    GAIN_END,
    GEO,
    H_SLIPPED,
    INPUTS,
    LAW_INPUTS,
    MATRIX,
    NEWTON,
    OLD,
    PLASTIC,
    PLASTIC_GEO,
    PLASTIC_SLOPE,
    RATIO_OLD,
    ROWS,
    SLOPE,
    STRAIN,
    T_SLIPPED,
    TANGENT,
    D,
    H,
    T,
)  # fmt: skip
from .substeps import settle, through_start

VECTOR = 8  #: numbers that one instruction handles, at most


@kernel
def evaluate(law, constants, rule, terms, pool, width):
    """Evaluate residual and Jacobian at every lane's trial state."""
    rows, total, evolving = pool.rows, constants.total, constants.evolving
    geometry(rows, constants.line, constants.tan_mu, total, width)
    sum_planes(
        rows,
        pool.slide,
        pool.guess,
        pool.base,
        pool.buffer,
        rule,
        terms.always,
        terms.evolving,
        constants.elastic,
        total,
        evolving,
        width,
    )
    friction_columns(rows, width)
    strain_and_slope(rows, D, H, T, STRAIN, SLOPE, GEO, total, evolving, width)
    if evolving:
        strain_and_slope(
            rows, D_SLIPPED, H_SLIPPED, T_SLIPPED, PLASTIC, PLASTIC_SLOPE, PLASTIC_GEO, total, evolving, width
        )
        law_inputs(rows, 0.5, width)
        fabric_rows(law, rows, width)
    gather(rows, terms.components, evolving, width)
    norms(rows, terms.components, evolving, width)


@kernel
def fill(constants, rule, pool, data, out, order, following, l):
    """Give a lane the next point that can be tried; return the place in the order after it."""
    pool.counts[CODE, l] = IDLE
    while following < order.shape[0]:
        following += 1
        if load(constants, rule, pool, data, out, order[following - 1], l):
            pool.counts[CODE, l] = TRIAL
            break
    return following


@kernel
def solve_lanes(law, constants, rule, components, pool, balanced, width):
    """Solve every lane's system for the Newton step, and where some lane is in equilibrium for tangent and error."""
    rows, evolving = pool.rows, constants.evolving
    n = components.shape[0] * (2 if evolving else 1)
    factorise(rows, MATRIX, n, width)
    solve(rows, MATRIX, NEWTON, n, 1, width)
    if balanced == 0:
        return
    if evolving:
        law_inputs(rows, 1.0, width)
        increments(law, rows[INPUTS * LANES : (INPUTS + LAW_INPUTS) * LANES], rows[GAIN_END * LANES :], width)
        if 13 in active_inputs(law):
            by_ratio(rows, OLD, RATIO_OLD, width)
    right_hand_sides(rows, components, evolving, width)
    for l in range(width):
        if pool.counts[CODE, l] == EQUILIBRIUM and rows[spot(FRACTION, l)] > 0.0:
            through_start(law, constants, rule, components, pool, l)
    solve(rows, MATRIX, TANGENT, n, 6, width)
    solve(rows, MATRIX, ERRORS, n, 1, width)
    error_norms(rows, components, evolving, width)


@kernel
def move(pool, source, target):
    """Copy a lane to another place."""
    for row in range(ROWS):
        pool.rows[spot(row, target)] = pool.rows[spot(row, source)]
    for a in range(pool.dslide.shape[1]):
        pool.slide[spot(a, target)] = pool.slide[spot(a, source)]
        for k in range(6):
            pool.guess[spot(6 * a + k, target)] = pool.guess[spot(6 * a + k, source)]
    for a in range(pool.base.shape[0] // LANES):
        pool.base[spot(a, target)] = pool.base[spot(a, source)]
    assign(pool.change[target], pool.change[source])
    assign(pool.dz[target], pool.dz[source])
    assign(pool.dslide[target], pool.dslide[source])
    for k in range(6):
        pool.counts[k, target] = pool.counts[k, source]


@entry
def integrate(law, constants, rule, terms, pool, data, out, order):
    """Integrate the points of `order`, one after another as lanes become free; see the module's docstring."""
    components, count = terms.components, pool.counts
    following, held = np.int64(0), np.int64(0)
    while held < LANES and following < order.shape[0]:
        following = fill(constants, rule, pool, data, out, order, following, held)
        held += np.int64(count[CODE, held] != IDLE)
    while held > 0:
        # lanes in use lie side by side at the front; the few beyond them fill the vector
        width = min(VECTOR * ((held + VECTOR - 1) // VECTOR), LANES)
        solving, balanced = np.int64(0), np.int64(0)
        evaluate(law, constants, rule, terms, pool, width)
        for l in range(held):
            count[CODE, l] = judge(constants, rule.weights.shape[0], pool, l)
            solving += count[CODE, l] != TRIAL
            balanced += count[CODE, l] == EQUILIBRIUM
        if solving == 0:
            continue
        solve_lanes(law, constants, rule, components, pool, balanced, width)
        for l in range(held - 1, -1, -1):
            if count[CODE, l] > TRIAL:
                if settle(constants, components, rule, pool, data[6], out, l):
                    following = fill(constants, rule, pool, data, out, order, following, l)
                else:
                    count[CODE, l] = TRIAL
            if count[CODE, l] == IDLE:
                held -= 1
                if held > l:
                    move(pool, held, l)
                count[CODE, held] = IDLE
