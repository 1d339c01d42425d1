"""Integration of many points over their strain increments: a pool of lanes, each at its own place in its own point.

A round evaluates residual and Jacobian at the trial state of every lane at once; then each lane decides by itself:

* inside the domain and nearer to equilibrium: accept, take a Newton step; else halve the step (line search);
* in equilibrium: compare with backward Euler (embedded, first order), accept the sub-step or cut it;
* at the end of its increment: write the answer and take the next point;
* under the open pressure: the packing has opened, the rest of the increment is a gap (see `open_point`);
* out of means: a status code, nothing written.

Where a contact about to slide would have to slide backwards and, held, would be overloaded, the law has no equilibrium
near by: the packing jumps. The jump is followed with viscous sliding: a relaxed sub-step does a share of the sliding
required, the rest is left to the next ones and shows in the error reported.

Sub-steps are dyadic fractions of the increment, so that the answer is a smooth function of the increment
wherever their number does not change, and the tangent returned is its derivative.
"""

import numpy as np

from .. import status
from ..fabric.law import active_inputs, increments
from ..lanes import LANES, entry, kernel, spot
from .balance import FLOOR, contact_density, critical_void_ratio, friction_columns, geometry, strain_and_slope
from .contact import sum_planes
from .elimination import factorise, solve
from .history import advance, assign, carried, clear, density, law_carried, start_force
from .residual import FABRIC_WEIGHT, by_ratio, error_norms, fabric_rows, gather, law_inputs, norms, right_hand_sides
from .rows import (
    ACCEPTED,
    BEST,
    BY_VOID_STRAIN,
    CLOSING,
    D_SLIPPED,
    DRIVE,
    DRIVE_START,
    ERROR,
    ERRORS,
    FABRIC,
    FABRIC_ERROR,
    FACTOR,
    FORCE,
    FORCE_OLD,
    FRACTION,
    FULL,
    GAIN_END,
    GEO,
    H_SLIPPED,
    HIGH,
    INPUTS,
    LAW_INPUTS,
    LENGTH,
    LOW,
    MARGIN,
    MATRIX,
    MISSING,
    NEWTON,
    NORM,
    OLD,
    PART,
    PLASTIC,
    PLASTIC_GEO,
    PLASTIC_SLOPE,
    PORTION,
    RATIO_OLD,
    ROWS,
    SHARE,
    SLOPE,
    STEP,
    STRAIN,
    STRESS_ERROR,
    STRESS_NORM,
    T_SLIPPED,
    TANGENT,
    VOID,
    VOID_START,
    D,
    H,
    T,
    Y,
)  # fmt: skip

NEWTON_TOLERANCE = 1e-9  #: of the residual strain, relative to the sub-step
NEWTON_FLOOR = 2e-15  #: of the residual strain, absolute: the rounding of the sums
STALLED = 1e-6  #: residual relative to the sub-step that is taken when rounding stops the line search
MAX_ITERATIONS = 30
MAX_TRIES = 10  #: of one line search
CONTENT = 0.5  #: part of the residual along the step that may be left, of the other sign
RELAXABLE = 2.0**-4  #: greatest fraction of an increment for a relaxed sub-step
SMALLEST = 2.0**-14  #: least fraction of an increment
MAX_VOID_RATIO = 1.64  #: the contact density ∝ 13.28 − 8 e stays positive
STRESS_FLOOR = 1e-3  #: of p_ref; below it the error of the stress is not relative
NEARLY_OPEN = 20.0  #: times the open pressure: a point that fails below it opens
VECTOR = 8  #: numbers that one instruction handles, at most
IDLE, TRIAL, ITERATE, EQUILIBRIUM, CUT = 0, 1, 2, 3, 4
POINT, EVALUATIONS, SUBSTEPS, ITERATIONS, TRIES, CODE = 0, 1, 2, 3, 4, 5


@kernel
def evaluate(law, constants, rule, terms, pool, width):
    """Evaluate residual and Jacobian at every lane's trial state."""
    rows, total, evolving = pool.rows, constants.total, constants.evolving
    geometry(rows, constants.line, constants.tan_mu, total, width)
    sum_planes(
        rows,
        pool.slide,
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
def begin(pool, l):
    """Set the trial state of a new sub-step: the old stress and fabric, the void ratio of its end."""
    rows = pool.rows
    portion, fraction = rows[spot(PORTION, l)], rows[spot(FRACTION, l)]
    volume = rows[spot(FULL, l)] + rows[spot(FULL + 1, l)] + rows[spot(FULL + 2, l)]
    for i in range(6):
        rows[spot(PART + i, l)] = portion * rows[spot(FULL + i, l)]
    for i in range(12):
        rows[spot(Y + i, l)] = rows[spot(OLD + i, l)]
    specific = (1.0 + rows[spot(VOID_START, l)]) * np.exp(-(fraction + portion) * volume)
    rows[spot(Y + VOID, l)] = specific - 1.0
    rows[spot(BY_VOID_STRAIN, l)] = -specific * (fraction + portion)
    rows[spot(FACTOR, l)] = 1.0
    rows[spot(BEST, l)] = np.inf
    pool.counts[ITERATIONS, l] = 0
    pool.counts[TRIES, l] = 0


@kernel
def toward_centre(rows, l, keep):
    """Move the trial stress toward 3 p G, where no contact has a tangential force, keeping a part of the rest."""
    p = (rows[spot(OLD, l)] + rows[spot(OLD + 1, l)] + rows[spot(OLD + 2, l)]) / 3.0
    for i in range(6):
        centre = p * ((1.0 if i < 3 else 0.0) + 0.4 * rows[spot(Y + FABRIC + i, l)])
        rows[spot(Y + i, l)] = centre + keep * (rows[spot(OLD + i, l)] - centre)


@kernel
def place_trial(rows, l):
    """Set the trial state to a part of the last Newton step."""
    for i in range(12):
        rows[spot(Y + i, l)] = rows[spot(ACCEPTED + i, l)] + rows[spot(FACTOR, l)] * rows[spot(STEP + i, l)]


@kernel
def search(pool, inside, l):
    """Return whether the line search is content; if not, the next trial is set.

    Content means that along the step the residual has lost most of what drove it, without turning far the other way.
    """
    rows = pool.rows
    factor, low, start, now = (
        rows[spot(FACTOR, l)], rows[spot(LOW, l)], rows[spot(DRIVE_START, l)], rows[spot(DRIVE, l)],
    )  # fmt: skip
    norm, best = rows[spot(NORM, l)], rows[spot(BEST, l)]
    if inside and (norm <= 0.5 * best or (start > 0.0 and now >= -CONTENT * start)):
        return True
    if inside and start <= 0.0 and norm < (1.0 - 1e-4 * factor) * best:
        return True
    share = 0.5
    if inside and start > 0.0:
        share = min(max(start / (start - now), 0.1), 0.5)
    rows[spot(HIGH, l)] = factor
    rows[spot(FACTOR, l)] = low + share * (factor - low)
    pool.counts[TRIES, l] += 1
    place_trial(rows, l)
    return False


@kernel
def judge(pool, l):
    """Return what a lane does with the state just evaluated."""
    rows, count = pool.rows, pool.counts
    count[EVALUATIONS, l] += 1
    norm, best, length = rows[spot(NORM, l)], rows[spot(BEST, l)], rows[spot(LENGTH, l)]
    inside = rows[spot(MARGIN, l)] > 0.0 and np.isfinite(norm)
    rounding = norm <= STALLED * length + 10.0 * NEWTON_FLOOR
    if count[ITERATIONS, l] == 0:
        if not inside:
            count[TRIES, l] += 1
            if count[TRIES, l] > 4:
                return CUT
            toward_centre(rows, l, 1.0 - 0.25 * count[TRIES, l])
            return TRIAL
    elif not (inside and rounding) and not search(pool, inside, l):
        return TRIAL if count[TRIES, l] <= MAX_TRIES else CUT
    rows[spot(BEST, l)] = norm
    count[TRIES, l] = 0
    count[ITERATIONS, l] += 1
    if norm <= NEWTON_TOLERANCE * length + NEWTON_FLOOR or (rounding and norm > 0.5 * best):
        return EQUILIBRIUM
    for i in range(12):
        rows[spot(ACCEPTED + i, l)] = rows[spot(Y + i, l)]
    return ITERATE if count[ITERATIONS, l] <= MAX_ITERATIONS else CUT


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


@kernel
def local_error(rows, l):
    """Return the estimated error of the sub-step: of the stress relative to its norm, or of the fabric."""
    stress = np.sqrt(rows[spot(STRESS_NORM, l)]) + STRESS_FLOOR
    return max(np.sqrt(rows[spot(STRESS_ERROR, l)]) / stress, np.sqrt(rows[spot(FABRIC_ERROR, l)]))


@kernel
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
    for i in range(13):
        rows[spot(OLD + i, l)] = rows[spot(Y + i, l)]
    for i in range(9):
        rows[spot(FORCE_OLD + i, l)] = rows[spot(FORCE + i, l)]
    for a in range(count):
        pool.slide[spot(a, l)] = pool.slide[spot(count + a, l)]
    portion = rows[spot(PORTION, l)]
    rows[spot(SHARE, l)] = min(4.0 * rows[spot(SHARE, l)], 1.0)
    rows[spot(FRACTION, l)] += portion
    fraction = rows[spot(FRACTION, l)]
    aligned = np.floor(fraction / (2.0 * portion)) * 2.0 * portion == fraction
    if error < 0.2 * constants.tolerance and aligned and fraction + 2.0 * portion <= 1.0:
        rows[spot(PORTION, l)] = 2.0 * portion
    begin(pool, l)


@kernel
def reason(constants, rule, pool, l):
    """Return the status code of a point that cannot go on."""
    rows = pool.rows
    if pool.counts[EVALUATIONS, l] >= constants.max_evaluations:
        return status.WORK_LIMIT
    p = (rows[spot(OLD, l)] + rows[spot(OLD + 1, l)] + rows[spot(OLD + 2, l)]) / 3.0
    if critical_void_ratio(p, constants.line)[0] < 1.5 * FLOOR:
        return status.PRESSURE_RANGE
    least = 1.0
    for a in range(rule.weights.shape[0]):
        n = (rule.normals[a, 0], rule.normals[a, 1], rule.normals[a, 2])
        least = min(least, density(rows, n, l))
    return status.FABRIC_LIMIT if least < 0.01 else status.NO_CONVERGENCE


@kernel
def cut(constants, rule, pool, out, factor, lost, l):
    """Shorten or relax the sub-step; when that is over, open the point or refuse it, and return True.

    lost: no equilibrium was found. Short sub-steps without one are relaxed: see the module's docstring.
    """
    rows = pool.rows
    if lost and rows[spot(PORTION, l)] <= RELAXABLE and 0.25 * rows[spot(SHARE, l)] >= constants.least_share:
        rows[spot(SHARE, l)] *= 0.25
    else:
        rows[spot(PORTION, l)] *= factor
    if rows[spot(PORTION, l)] >= SMALLEST and pool.counts[EVALUATIONS, l] < constants.max_evaluations:
        begin(pool, l)
        return False
    p = (rows[spot(OLD, l)] + rows[spot(OLD + 1, l)] + rows[spot(OLD + 2, l)]) / 3.0
    if p < NEARLY_OPEN * constants.open_pressure:
        open_point(constants, rule, pool, out, l)
    else:
        report(pool, out, reason(constants, rule, pool, l), l)
    return True


@kernel
def load(constants, rule, pool, data, out, point, l):
    """Put a point into a lane and return True, or settle it at once: refused, or open all the time."""
    stress, fabric, void_ratio, slip, force, gap, strain = data
    rows = pool.rows
    for k in range(6):
        pool.counts[k, l] = 0
    pool.counts[POINT, l] = point
    total, volume = void_ratio[point] + gap[point], strain[point, 0] + strain[point, 1] + strain[point, 2]
    closing = min(gap[point] / volume, 1.0) if volume > 0.0 else (1.0 if gap[point] > 0.0 else 0.0)
    for i in range(6):
        rows[spot(FULL + i, l)] = (1.0 - closing) * strain[point, i]
        rows[spot(OLD + i, l)], rows[spot(OLD + FABRIC + i, l)] = stress[point, i], fabric[point, i]
        total += strain[point, i] + stress[point, i] + fabric[point, i]
    start = (1.0 + void_ratio[point]) * np.exp(-closing * volume) - 1.0
    rows[spot(OLD + VOID, l)], rows[spot(VOID_START, l)], rows[spot(CLOSING, l)] = start, start, closing
    rows[spot(FRACTION, l)], rows[spot(PORTION, l)], rows[spot(ERROR, l)] = 0.0, 1.0, 0.0
    rows[spot(SHARE, l)] = 1.0
    for a in range(slip.shape[1]):
        total += slip[point, a]
        pool.slide[spot(a, l)] = slip[point, a]
        if not constants.total:
            for i in range(3):
                total += force[point, a, i]
                pool.base[spot(3 * a + i, l)] = force[point, a, i]
    if not (np.isfinite(total) and stress[point, 0] + stress[point, 1] + stress[point, 2] > 0.0):
        return report(pool, out, status.BAD_INPUT, l)
    end = (1.0 + void_ratio[point]) * np.exp(-volume) - 1.0
    if not (FLOOR < end < MAX_VOID_RATIO and FLOOR < void_ratio[point] < MAX_VOID_RATIO):
        return report(pool, out, status.VOID_RATIO_RANGE, l)
    start_force(rows, constants.total, l)
    if closing == 1.0:
        out[2][point], out[5][point] = end, gap[point] - volume
        elastic_open(constants, rows, out[6], point, l)
        return report(pool, out, status.OK, l)
    begin(pool, l)
    return True


@kernel
def report(pool, out, code, l):
    """Write a point's status and the work spent on it; return False."""
    point = pool.counts[POINT, l]
    out[7][point], out[8][point] = code, pool.rows[spot(ERROR, l)]
    out[9][point], out[10][point] = pool.counts[EVALUATIONS, l], pool.counts[SUBSTEPS, l]
    return False


@kernel
def elastic_open(constants, rows, tangent, point, l):
    """Write the tangent of an open point: its stress is constant, so this is a stabilisation and has a name."""
    density = contact_density(rows[spot(OLD + VOID, l)])[0]
    compliance, ease_t, _ = constants.elastic
    normal = 4.5 * compliance / np.sqrt(3.0 * constants.open_pressure / density) / density
    bulk, shear = 1.0 / normal, 1.0 / (normal * (2.0 / 15.0 + ease_t / 5.0))
    for i in range(6):
        for j in range(6):
            volumetric = bulk - shear / 3.0 if i < 3 and j < 3 else 0.0
            tangent[point, i, j] = constants.open_stiffness * (volumetric + (shear if i == j else 0.0))


@kernel
def open_point(constants, rule, pool, out, l):
    """Write the answer of a point that opens in this sub-step: the pressure falls to the open pressure and stays there.

    Stress becomes 3 p G, under which no contact has a tangential force; fabric and sliding stay what they were when the
    sub-step began, and the volumetric strain left is the gap.
    """
    stress, fabric, void_ratio, slip, force, gap, tangent = out[:7]
    rows, point = pool.rows, pool.counts[POINT, l]
    p, volume = constants.open_pressure, rows[spot(FULL, l)] + rows[spot(FULL + 1, l)] + rows[spot(FULL + 2, l)]
    for i in range(6):
        fabric[point, i] = rows[spot(OLD + FABRIC + i, l)]
        stress[point, i] = p * ((1.0 if i < 3 else 0.0) + 0.4 * fabric[point, i])
    gap[point] = max(-(1.0 - rows[spot(FRACTION, l)]) * volume, 0.0)
    void_ratio[point] = (1.0 + rows[spot(VOID_START, l)]) * np.exp(-volume) - 1.0
    for a in range(slip.shape[1]):
        slip[point, a] = pool.slide[spot(a, l)]
        if not constants.total:
            for i in range(3):
                force[point, a, i] = 3.0 * p / contact_density(void_ratio[point])[0] * rule.normals[a, i]
    elastic_open(constants, rows, tangent, point, l)
    report(pool, out, status.OK, l)


@kernel
def finish(constants, rule, pool, strain, out, l):
    """Write a point's answer."""
    stress, fabric, void_ratio, slip, force, gap, tangent = out[:7]
    rows, count = pool.rows, rule.weights.shape[0]
    point, closing, new = pool.counts[POINT, l], rows[spot(CLOSING, l)], pool.new_change
    volume = strain[point, 0] + strain[point, 1] + strain[point, 2]
    for i in range(6):
        stress[point, i], fabric[point, i] = rows[spot(Y + i, l)], rows[spot(Y + FABRIC + i, l)]
        along = 0.0
        for c in range(6):
            tangent[point, i, c] = (1.0 - closing) * new[i, c]
            along += new[i, c] * strain[point, c]
        if closing > 0.0:
            # the contacts feel (1 − s) Δε, s = gap / Δε_v, and ds = −s dε_v / Δε_v
            for c in range(3):
                tangent[point, i, c] += closing / volume * along
    void_ratio[point], gap[point] = rows[spot(Y + VOID, l)], 0.0
    for a in range(slip.shape[1]):
        slip[point, a] = pool.slide[spot(count + a, l)]
        if not constants.total:
            for i in range(3):
                whole = pool.base[spot(3 * a + i, l)]
                for k in range(3):
                    whole += rows[spot(FORCE + 3 * i + k, l)] * rule.normals[a, k]
                force[point, a, i] = whole
    report(pool, out, status.OK, l)


@kernel
def fill(constants, rule, pool, data, out, following, stop, l):
    """Give a lane the next point that can be tried; return the number of the point after it."""
    pool.counts[CODE, l] = IDLE
    while following < stop:
        following += 1
        if load(constants, rule, pool, data, out, following - 1, l):
            pool.counts[CODE, l] = TRIAL
            break
    return following


@kernel
def take_step(pool, components, evolving, l):
    """Set the trial state to the Newton step just solved; False if it is not finite."""
    rows, nc = pool.rows, components.shape[0]
    total, drive = 0.0, 0.0
    for row in range(nc):
        step = rows[spot(NEWTON + row, l)]
        rows[spot(STEP + components[row], l)] = step
        total += step
        drive += step * rows[spot(MISSING + row, l)]
        if evolving:
            step = rows[spot(NEWTON + nc + row, l)]
            rows[spot(STEP + FABRIC + components[row], l)] = step
            total += step
            drive += FABRIC_WEIGHT * rows[spot(ACCEPTED, l)] * step * rows[spot(MISSING + nc + row, l)]
    rows[spot(FACTOR, l)], rows[spot(LOW, l)], rows[spot(DRIVE_START, l)] = 1.0, 0.0, drive
    place_trial(rows, l)
    return np.isfinite(total)


@kernel
def settle(constants, components, rule, pool, strain, out, l):
    """Act on a lane's solved system; return True when its point is finished, one way or the other."""
    rows = pool.rows
    if pool.counts[CODE, l] == ITERATE and take_step(pool, components, constants.evolving, l):
        return False
    if pool.counts[CODE, l] != EQUILIBRIUM:
        return cut(constants, rule, pool, out, 0.25, True, l)
    if rows[spot(Y, l)] + rows[spot(Y + 1, l)] + rows[spot(Y + 2, l)] < 3.0 * constants.open_pressure:
        open_point(constants, rule, pool, out, l)
        return True
    error = local_error(rows, l)
    factor = 0.5
    while factor * factor * error > 0.8 * constants.tolerance and factor > 2.0**-6:
        factor *= 0.5
    relaxed = rows[spot(SHARE, l)] < 1.0
    if not error <= constants.tolerance and rows[spot(PORTION, l)] * factor >= SMALLEST and not relaxed:
        return cut(constants, rule, pool, out, factor, False, l)
    rows[spot(ERROR, l)] += error
    pool.counts[SUBSTEPS, l] += 1
    collect(pool, components, constants.evolving, l)
    if rows[spot(FRACTION, l)] + rows[spot(PORTION, l)] >= 1.0:
        finish(constants, rule, pool, strain, out, l)
        return True
    next_substep(constants, rule, pool, error, l)
    return False


@kernel
def solve_lanes(law, constants, rule, components, pool, equilibrium, width):
    """Solve every lane's system for the Newton step, and where some lane is in equilibrium for tangent and error."""
    rows, evolving = pool.rows, constants.evolving
    n = components.shape[0] * (2 if evolving else 1)
    factorise(rows, MATRIX, n, width)
    solve(rows, MATRIX, NEWTON, n, 1, width)
    if not equilibrium:
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
    for a in range(pool.base.shape[0] // LANES):
        pool.base[spot(a, target)] = pool.base[spot(a, source)]
    assign(pool.change[target], pool.change[source])
    assign(pool.dz[target], pool.dz[source])
    assign(pool.dslide[target], pool.dslide[source])
    for k in range(6):
        pool.counts[k, target] = pool.counts[k, source]


@entry
def integrate(law, constants, rule, terms, pool, data, out, start, stop):
    """Integrate the points start…stop-1; see the module's docstring."""
    components, count = terms.components, pool.counts
    following, held = start, 0
    while held < LANES and following < stop:
        following = fill(constants, rule, pool, data, out, following, stop, held)
        held += count[CODE, held] != IDLE
    while held > 0:
        # lanes in use lie side by side at the front; the few beyond them fill the vector
        width = min(VECTOR * ((held + VECTOR - 1) // VECTOR), LANES)
        solving, equilibrium = False, False
        evaluate(law, constants, rule, terms, pool, width)
        for l in range(held):
            count[CODE, l] = judge(pool, l)
            solving = solving or count[CODE, l] != TRIAL
            equilibrium = equilibrium or count[CODE, l] == EQUILIBRIUM
        if not solving:
            continue
        solve_lanes(law, constants, rule, components, pool, equilibrium, width)
        for l in range(held - 1, -1, -1):
            if count[CODE, l] > TRIAL:
                if settle(constants, components, rule, pool, data[6], out, l):
                    following = fill(constants, rule, pool, data, out, following, stop, l)
                else:
                    count[CODE, l] = TRIAL
            if count[CODE, l] == IDLE:
                held -= 1
                if held > l:
                    move(pool, held, l)
                count[CODE, held] = IDLE
