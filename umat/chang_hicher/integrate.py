"""Integration of many points over their strain increments: a pool of lanes, each at its own place in its own point.

A round evaluates residual and Jacobian at the trial state of every lane at once. What only the tangent, the error and
the last digits of Newton's step need is evaluated once: a lane that expects its next trial to be the last waits until
half of the lanes do. Then each lane decides by itself:

* `iteration`: inside the domain, take the next Newton step; outside, come back;
* `substeps`: in equilibrium, compare with backward Euler (embedded, first order), accept the sub-step or cut it;
* `points`: at the end of its increment, write the answer and take the next point; under the open pressure, the
  packing has opened and the rest of the increment is a gap; out of means, a status code, nothing written.
"""

import numpy as np

from ..fabric.law import active_inputs, increments
from ..lanes import LANES, entry, inlined, kernel, spot
from .balance import add_elastic, friction_columns, geometry, strain_and_slope
from .contact import end_of_step, sum_planes
from .elimination import factorise, solve
from .iteration import correct, judge
from .points import load
from .pool import CODE, EQUILIBRIUM, IDLE, TRIAL
from .residual import by_ratio, error_norms, fabric_rows, gather, law_inputs, norms, right_hand_sides
from .rows import (
    D_SLIPPED,
    ERRORS,
    FINAL,
    FRACTION,
    FRESH,
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
    SLOPE,
    STRAIN,
    T_SLIPPED,
    TAKEN,
    TANGENT,
    D,
    H,
    T,
)  # fmt: skip
from .substeps import settle, through_start


@kernel
def evaluate(law, constants, rule, terms, pool, full, fresh):
    """Evaluate residual and Jacobian at every lane's trial state; full: with all that tangent and error need."""
    rows, total, evolving = pool.rows, constants.total, constants.evolving
    geometry(rows, constants.line, constants.tan_mu, total)
    sum_planes(
        rows, pool.slide, pool.guess, pool.start, pool.base, pool.buffer, rule, terms, constants.elastic,
        total, evolving, full, fresh,
    )  # fmt: skip
    add_elastic(rows)
    friction_columns(rows)
    strain_and_slope(rows, D, H, T, STRAIN, SLOPE, GEO, total, evolving, full)
    if evolving:
        strain_and_slope(
            rows, D_SLIPPED, H_SLIPPED, T_SLIPPED, PLASTIC, PLASTIC_SLOPE, PLASTIC_GEO, total, evolving, full
        )
        law_inputs(rows, 0.5)
        fabric_rows(law, rows)
    gather(rows, terms.components, evolving)
    norms(rows, terms.components, evolving)


@inlined
def fill(constants, rule, pool, data, out, order, following):
    """Give every idle lane the next point that can be tried; return the place in the order after them."""
    for l in range(LANES):
        while pool.counts[CODE, l] == IDLE and following < order.shape[0]:
            following += 1
            if load(constants, rule, pool, data, out, order[following - 1], l):
                pool.counts[CODE, l] = TRIAL
    return following


@kernel
def solve_lanes(law, constants, rule, components, pool, balanced):
    """Solve every lane's system for the Newton step, and where some lane is in equilibrium for tangent and error."""
    rows, evolving = pool.rows, constants.evolving
    n = components.shape[0] * (2 if evolving else 1)
    factorise(rows, MATRIX, n)
    solve(rows, MATRIX, NEWTON, n, 1)
    if balanced == 0:
        return
    if evolving:
        law_inputs(rows, 1.0)
        increments(law, rows[INPUTS * LANES : (INPUTS + LAW_INPUTS) * LANES], rows[GAIN_END * LANES :])
        if 13 in active_inputs(law):
            by_ratio(rows, OLD, RATIO_OLD)
    right_hand_sides(rows, components, evolving)
    for l in range(LANES):
        if pool.counts[CODE, l] == EQUILIBRIUM and rows[spot(FRACTION, l)] > 0.0:
            through_start(law, constants, rule, components, pool, l)
    solve(rows, MATRIX, TANGENT, n, 6)
    solve(rows, MATRIX, ERRORS, n, 1)
    error_norms(rows, components, evolving)
    for l in range(LANES):
        if pool.counts[CODE, l] == EQUILIBRIUM:
            correct(pool, components, evolving, l)
    # forces and sliding of the corrected state
    geometry(rows, constants.line, constants.tan_mu, constants.total)
    end_of_step(rows, pool.slide, pool.base, rule, constants.elastic, constants.total)


@inlined
def judge_lanes(constants, count, pool, full):
    """Find what each lane does next; return how many need their system solved, and how many are in equilibrium.

    A lane that waits for a full evaluation is left as it is: what others need must not change its answer.
    """
    codes, solving, balanced = pool.counts[CODE], 0, 0
    for l in range(LANES):
        if codes[l] == IDLE:
            continue
        if pool.rows[spot(FINAL, l)] == 1.0 and not full:
            pool.rows[spot(TAKEN, l)] = 0.0
            continue
        codes[l] = judge(constants, count, pool, l)
        solving += codes[l] != TRIAL
        balanced += codes[l] == EQUILIBRIUM
    return solving, balanced


@entry
def integrate(law, constants, rule, terms, pool, data, out, order):
    """Integrate the points of `order`, one after another as lanes become free; see the module's docstring."""
    codes, following = pool.counts[CODE], np.int64(0)
    codes[:] = IDLE
    while True:
        following = fill(constants, rule, pool, data, out, order, following)
        busy, waiting, fresh = 0, 0, False
        for l in range(LANES):
            busy += codes[l] != IDLE
            waiting += codes[l] != IDLE and pool.rows[spot(FINAL, l)] == 1.0
            fresh = fresh or (codes[l] != IDLE and pool.rows[spot(FRESH, l)] == 1.0)
        if busy == 0:
            return
        full = 2 * waiting >= busy
        evaluate(law, constants, rule, terms, pool, full, fresh)
        solving, balanced = judge_lanes(constants, rule.weights.shape[0], pool, full)
        if solving == 0:
            continue
        solve_lanes(law, constants, rule, terms.components, pool, balanced)
        for l in range(LANES):
            if codes[l] > TRIAL:
                finished = settle(constants, terms.components, rule, pool, data[6], out, l)
                codes[l] = IDLE if finished else TRIAL
