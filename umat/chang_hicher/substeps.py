"""Sub-steps of one lane: their error, their size, their end, and the chain of their tangents.

Sub-steps are dyadic fractions of the increment, so that the answer is a smooth function of the increment
wherever their number does not change, and the tangent returned is its derivative.

Where a contact about to slide would have to slide backwards and, held, would be overloaded, the law has no equilibrium
near by: the packing jumps. The jump is followed with viscous sliding: a relaxed sub-step does a share of the sliding
required, the rest is left to the next ones and shows in the error reported.
"""

import numpy as np

from .. import status
from ..fabric.law import active_inputs
from ..lanes import inlined, kernel, spot
from .balance import FLOOR, MAX_VOID_RATIO, critical_void_ratio
from .history import advance, assign, carried, clear, density, law_carried
from .iteration import again, begin, take_step
from .points import finish, mean_force, old_pressure, open_point, report
from .pool import CODE, EQUILIBRIUM, EVALUATIONS, ITERATE, SUBSTEPS
from .rows import (
    BY_VOID_STRAIN,
    ERROR,
    FABRIC,
    FABRIC_ERROR,
    FORCE,
    FORCE_OLD,
    FRACTION,
    OLD,
    PORTION,
    RAISING,
    SHARE,
    STEP,
    STRESS_ERROR,
    STRESS_NORM,
    TANGENT,
    VOID,
    Y,
)  # fmt: skip

RELAXABLE = 2.0**-7  #: greatest fraction of an increment for a relaxed sub-step
FIRST_SHARE, RAISE = 0.0625, 2.0
SMALLEST = 2.0**-14  #: least fraction of an increment
CROSSING = 2.0**-6  #: greatest fraction in which a point may open
STRESS_FLOOR = 1e-3  #: of p_ref; below it the error of the stress is not relative
NEARLY_OPEN = 20.0  #: times the open pressure: a point that fails below it opens


@kernel
def through_start(law, constants, rule, components, pool, l):
    """Subtract from the tangent's right-hand side what depends on the increment through the start of the sub-step."""
    rows, nc = pool.rows, components.shape[0]
    carried(
        rows, pool.slide, pool.base, rule, constants, pool.change[l], pool.dz[l], pool.dslide[l], pool.carried,
        pool.small, pool.long, l,
    )  # fmt: skip
    if constants.evolving:
        ratio = 13 in active_inputs(law)
        law_carried(rows, pool.change[l], pool.carried, pool.carried_fabric, ratio, l)
    for row in range(nc):
        for c in components:
            rows[spot(TANGENT + 6 * row + c, l)] -= pool.carried[components[row], c]
            if constants.evolving:
                rows[spot(TANGENT + 6 * (nc + row) + c, l)] -= pool.carried_fabric[components[row], c]


@inlined
def local_error(rows, l):
    """Return the estimated error of the sub-step: of the stress relative to its norm, or of the fabric."""
    stress = np.sqrt(rows[spot(STRESS_NORM, l)]) + STRESS_FLOOR
    return max(np.sqrt(rows[spot(STRESS_ERROR, l)]) / stress, np.sqrt(rows[spot(FABRIC_ERROR, l)]))


@inlined
def collect(pool, components, evolving, l):
    """Fill the derivative (13, 6) of the sub-step's end by the strain increment from the solved columns."""
    nc = components.shape[0]
    rows, new = pool.rows, pool.new_change
    clear(new)
    for c in range(3):
        new[VOID, c] = rows[spot(BY_VOID_STRAIN, l)]
    for row in range(nc):
        for c in components:
            new[components[row], c] = rows[spot(TANGENT + 6 * row + c, l)]
            if evolving:
                new[FABRIC + components[row], c] = rows[spot(TANGENT + 6 * (nc + row) + c, l)]


@kernel
def next_substep(constants, rule, pool, error, l):
    """Make the end of an accepted sub-step the start of the next one, which may be twice as long."""
    rows, count = pool.rows, rule.weights.shape[0]
    if rows[spot(FRACTION, l)] == 0.0:
        clear(pool.change[l])
        clear(pool.dz[l])
        clear(pool.dslide[l])
    advance(
        rows, pool.slide, pool.base, rule, constants, pool.change[l], pool.new_change, pool.dz[l], pool.dslide[l],
        pool.small, l,
    )  # fmt: skip
    assign(pool.change[l], pool.new_change)
    for i in range(12):
        rows[spot(STEP + i, l)] = rows[spot(Y + i, l)] - rows[spot(OLD + i, l)]
    for i in range(13):
        rows[spot(OLD + i, l)] = rows[spot(Y + i, l)]
    for i in range(9):
        rows[spot(FORCE_OLD + i, l)] = rows[spot(FORCE + i, l)]
    for a in range(count):
        pool.slide[spot(a, l)] = pool.slide[spot(count + a, l)]
    portion = rows[spot(PORTION, l)]
    rows[spot(SHARE, l)] = min(4.0 * rows[spot(SHARE, l)], 1.0)
    rows[spot(RAISING, l)] = 0.0 if rows[spot(SHARE, l)] == 1.0 else 2.0
    rows[spot(FRACTION, l)] += portion
    fraction = rows[spot(FRACTION, l)]
    aligned = np.floor(fraction / (2.0 * portion)) * 2.0 * portion == fraction
    if error < 0.2 * constants.tolerance and aligned and fraction + 2.0 * portion <= 1.0:
        rows[spot(PORTION, l)] = 2.0 * portion
    begin(pool.rows, pool.counts, l)
    for i in range(12):
        rows[spot(Y + i, l)] += rows[spot(PORTION, l)] / portion * rows[spot(STEP + i, l)]


@kernel
def reason(constants, rule, pool, l):
    """Return the status code of a point that cannot go on."""
    rows = pool.rows
    if pool.counts[EVALUATIONS, l] >= constants.max_evaluations:
        return status.WORK_LIMIT
    if critical_void_ratio(old_pressure(rows, l), constants.line)[0] < 1.5 * FLOOR:
        return status.PRESSURE_RANGE
    if rows[spot(Y + VOID, l)] > 0.98 * MAX_VOID_RATIO:
        return status.VOID_RATIO_RANGE
    least = 1.0
    for a in range(rule.weights.shape[0]):
        n = (rule.normals[a, 0], rule.normals[a, 1], rule.normals[a, 2])
        least = min(least, density(rows, n, l))
    return status.FABRIC_LIMIT if least < 0.01 else status.NO_CONVERGENCE


@kernel
def lost(constants, rule, pool, out, l):
    """Act on a sub-step without equilibrium; return True when the point is finished.

    First the share of sliding is raised in steps; then the sub-step is cut, or relaxed where it is short: see the
    module's docstring.
    """
    rows = pool.rows
    if rows[spot(RAISING, l)] == 0.0:
        rows[spot(RAISING, l)], rows[spot(SHARE, l)] = 1.0, FIRST_SHARE
        if pool.counts[EVALUATIONS, l] < constants.max_evaluations:
            begin(pool.rows, pool.counts, l)
            return False
    share = 1.0 if rows[spot(RAISING, l)] == 1.0 else rows[spot(SHARE, l)]
    if rows[spot(PORTION, l)] > RELAXABLE or 0.25 * share < constants.least_share:
        return cut(constants, rule, pool, out, 0.25, l)
    rows[spot(RAISING, l)], rows[spot(SHARE, l)] = 2.0, 0.25 * share
    return go_on(constants, rule, pool, out, l)


@kernel
def cut(constants, rule, pool, out, factor, l):
    """Shorten the sub-step; return True when that is over and the point finished."""
    rows = pool.rows
    if rows[spot(RAISING, l)] == 1.0:
        rows[spot(SHARE, l)] = 1.0
    rows[spot(RAISING, l)] = 0.0
    rows[spot(PORTION, l)] *= factor
    return go_on(constants, rule, pool, out, l)


@kernel
def go_on(constants, rule, pool, out, l):
    """Begin the sub-step again; out of means open the point or refuse it, and return True."""
    rows = pool.rows
    if rows[spot(PORTION, l)] >= SMALLEST and pool.counts[EVALUATIONS, l] < constants.max_evaluations:
        begin(pool.rows, pool.counts, l)
        return False
    p = min(old_pressure(rows, l), mean_force(constants, rule, pool, l))
    if p < NEARLY_OPEN * constants.open_pressure:
        open_point(constants, rule, pool, out, 0.0, l)
    else:
        report(pool, out, reason(constants, rule, pool, l), l)
    return True


@kernel
def opening(constants, rule, pool, out, p, l):
    """Act on a sub-step that ends at a pressure p below the open one; return True when the point is finished.

    Long sub-steps are cut, to find where it opens; in a short one √p, which goes with the strain of the contacts,
    is taken as linear.
    """
    rows = pool.rows
    if rows[spot(PORTION, l)] > CROSSING:
        return cut(constants, rule, pool, out, 0.25, l)
    start, least = np.sqrt(old_pressure(rows, l)), np.sqrt(constants.open_pressure)
    before = (start - least) / (start - np.sqrt(p)) if start > least else 0.0
    open_point(constants, rule, pool, out, before, l)
    return True


@inlined
def settle(constants, components, rule, pool, strain, out, l):
    """Act on a lane's solved system; return True when its point is finished, one way or the other."""
    rows = pool.rows
    if pool.counts[CODE, l] == ITERATE and take_step(pool, components, constants.evolving, l):
        return False
    if pool.counts[CODE, l] != EQUILIBRIUM:
        return lost(constants, rule, pool, out, l)
    if rows[spot(RAISING, l)] == 1.0 and rows[spot(SHARE, l)] < 1.0:
        rows[spot(SHARE, l)] *= RAISE
        again(pool.rows, pool.counts, l)
        return False
    p = (rows[spot(Y, l)] + rows[spot(Y + 1, l)] + rows[spot(Y + 2, l)]) / 3.0
    if p < constants.open_pressure:
        return opening(constants, rule, pool, out, p, l)
    error = local_error(rows, l)
    factor = 0.5
    while factor * factor * error > 0.8 * constants.tolerance and factor > 2.0**-6:
        factor *= 0.5
    relaxed = rows[spot(SHARE, l)] < 1.0
    if not error <= constants.tolerance and rows[spot(PORTION, l)] * factor >= SMALLEST and not relaxed:
        return cut(constants, rule, pool, out, factor, l)
    rows[spot(ERROR, l)] += error
    pool.counts[SUBSTEPS, l] += 1
    collect(pool, components, constants.evolving, l)
    if rows[spot(FRACTION, l)] + rows[spot(PORTION, l)] >= 1.0:
        finish(constants, rule, pool, strain, out, l)
        return True
    next_substep(constants, rule, pool, error, l)
    return False
