"""Integration of many points over their strain increments: a pool of lanes, each at its own place in its own point.

A round evaluates residual and Jacobian at the trial state of every lane at once; then each lane decides by itself:

* inside the domain and nearer to equilibrium: accept, take a Newton step; else halve the step (line search);
* in equilibrium: compare with backward Euler (embedded, first order), accept the sub-step or cut it;
* at the end of its increment: write the answer and take the next point;
* out of means: a status code, nothing written.

Sub-steps are dyadic fractions of the increment, so that the answer is a smooth function of the increment
wherever their number does not change, and the tangent returned is its derivative.
"""

import numpy as np

from .. import status
from ..fabric.law import INPUTS, active_inputs, increments
from ..lanes import LANES, kernel
from .balance import FLOOR, VOID, contract, critical_void_ratio, geometry, strain_and_slope, sum_planes
from .contact import FABRIC, FORCE, FORCE_OLD, MARGIN
from .elimination import equilibrate, factorise, solve
from .history import advance, carried, density, law_carried, start_force
from .pool import RHS
from .programs import COLUMNS, D, D_FIRST, D_PLASTIC, H, H_PLASTIC, T, T_PLASTIC
from .residual import by_ratio, fabric_rows, gather_system, law_inputs

NEWTON_TOLERANCE = 1e-10  #: of the residual strain, relative to the sub-step
NEWTON_FLOOR = 2e-15  #: of the residual strain, absolute: the rounding of the sums
STALLED = 1e-6  #: residual relative to the sub-step that is taken when rounding stops the line search
FABRIC_WEIGHT = 0.1  #: of the fabric residual beside the strain residual
MAX_ITERATIONS = 30
SMALLEST = 2.0**-14  #: least fraction of an increment
MAX_VOID_RATIO = 1.64  #: the contact density ∝ 13.28 − 8 e stays positive
STRESS_FLOOR = 1e-4  #: of p_ref; below it the error of the stress is not relative
IDLE, RETRY, ITERATE, CONVERGED = 0, 1, 2, 3
FRACTION, SIZE, FACTOR, RESIDUAL, ERROR, START = 0, 1, 2, 3, 4, 5
POINT, EVALUATIONS, SUBSTEPS, ITERATIONS, TRIES, CODE = 0, 1, 2, 3, 4, 5


@kernel
def evaluate(law, constants, rule, program, pool):
    """Evaluate residual and Jacobian at every lane's trial state."""
    total, evolving = constants.total, constants.evolving
    geometry(
        pool.y.reshape(-1), pool.old.reshape(-1), pool.work.reshape(-1), pool.place.reshape(-1),
        constants.line, constants.tan_mu, total,
    )  # fmt: skip
    sum_planes(
        pool.sums, pool.work, pool.base, pool.sliding, pool.sliding_new, pool.buffer, rule, constants.elastic,
        program, total, evolving,
    )  # fmt: skip
    strain, plastic, first = pool.strains[:6], pool.strains[6:12], pool.strains[12:]
    strain_and_slope(strain, pool.slope, pool.geo[:36], pool.scratch, pool.sums, pool.place, program, (D, H, T), evolving)
    if evolving:
        strain_and_slope(
            plastic, pool.plastic_slope, pool.geo[36:], pool.scratch, pool.sums, pool.place, program,
            (D_PLASTIC, H_PLASTIC, T_PLASTIC), evolving,
        )  # fmt: skip
        law_inputs(pool.inputs, pool.y, pool.old, pool.strain, plastic, pool.place, 0.5)
        fabric_rows(
            law, pool.inputs, pool.gain, pool.law_slope, pool.ratio_slope, pool.fabric_slope, pool.y, pool.old,
            pool.place, pool.plastic_slope,
        )  # fmt: skip
    gather_system(pool.matrix, program.components, pool.slope, pool.fabric_slope, evolving)
    first[:] = 0.0
    contract(first, program.strain_coefficient, pool.sums[D_FIRST : D_FIRST + 9], pool.place[:6], program.strain)


@kernel
def residual_norm(pool, components, evolving, l):
    """Return the norm of the residual, as a strain."""
    total = 0.0
    for i in components:
        total += (pool.strains[i, l] - pool.strain[i, l]) ** 2
        if evolving:
            total += (FABRIC_WEIGHT * (pool.y[6 + i, l] - pool.old[6 + i, l] - pool.gain[i, l])) ** 2
    return np.sqrt(total)


@kernel
def begin(pool, l):
    """Set the trial state of a new sub-step: the old stress and fabric, the void ratio of its end."""
    size, fraction = pool.number[SIZE, l], pool.number[FRACTION, l]
    volume = pool.full[0, l] + pool.full[1, l] + pool.full[2, l]
    for i in range(6):
        pool.strain[i, l] = size * pool.full[i, l]
    for i in range(12):
        pool.y[i, l] = pool.old[i, l]
    pool.y[VOID, l] = (1.0 + pool.number[START, l]) * np.exp(-(fraction + size) * volume) - 1.0
    pool.number[FACTOR, l] = 1.0
    pool.number[RESIDUAL, l] = np.inf
    pool.count[ITERATIONS, l] = 0
    pool.count[TRIES, l] = 0


@kernel
def toward_centre(pool, l, keep):
    """Move the trial stress toward 3 p G, where no contact has a tangential force, keeping a part of the rest."""
    p = (pool.old[0, l] + pool.old[1, l] + pool.old[2, l]) / 3.0
    for i in range(6):
        centre = p * ((1.0 if i < 3 else 0.0) + 0.4 * pool.y[6 + i, l])
        pool.y[i, l] = centre + keep * (pool.old[i, l] - centre)


@kernel
def retry(pool, l, factor):
    """Set the trial state to a part of the last Newton step."""
    pool.number[FACTOR, l] *= factor
    for i in range(12):
        pool.y[i, l] = pool.accepted[i, l] + pool.number[FACTOR, l] * pool.step[i, l]
    return RETRY


@kernel
def judge(pool, program, constants, l):
    """Return what a lane does with the state just evaluated: a code, or -1 to cut the sub-step."""
    pool.count[EVALUATIONS, l] += 1
    inside = pool.work[MARGIN, l] > 0.0
    norm = residual_norm(pool, program.components, constants.evolving, l)
    inside = inside and np.isfinite(norm)
    best = pool.number[RESIDUAL, l]
    size = 0.0
    for i in range(6):
        size += pool.strain[i, l] ** 2
    size = np.sqrt(size)
    if pool.count[ITERATIONS, l] == 0:
        if not inside:
            pool.count[TRIES, l] += 1
            if pool.count[TRIES, l] > 4:
                return -1
            toward_centre(pool, l, 1.0 - 0.25 * pool.count[TRIES, l])
            return RETRY
    elif not inside:
        return retry(pool, l, 0.5) if pool.number[FACTOR, l] > 1e-4 else -1
    elif norm > (1.0 - 1e-4 * pool.number[FACTOR, l]) * best:
        if norm > STALLED * size + 10.0 * NEWTON_FLOOR:
            return retry(pool, l, 0.5) if pool.number[FACTOR, l] > 1e-3 else -1
    for i in range(12):
        pool.accepted[i, l] = pool.y[i, l]
    stalled = norm > 0.5 * best and norm <= STALLED * size + 10.0 * NEWTON_FLOOR
    pool.number[RESIDUAL, l] = norm
    pool.number[FACTOR, l] = 1.0
    pool.count[ITERATIONS, l] += 1
    if norm <= NEWTON_TOLERANCE * size + NEWTON_FLOOR or stalled:
        return CONVERGED
    return ITERATE if pool.count[ITERATIONS, l] <= MAX_ITERATIONS else -1


@kernel
def right_hand_sides(law, constants, rule, program, pool, l):
    """Fill the six tangent columns and the error column of a lane in equilibrium."""
    components, evolving = program.components, constants.evolving
    nc = components.shape[0]
    done = pool.number[FRACTION, l] + pool.number[SIZE, l]
    by_void = -(1.0 + pool.y[VOID, l]) * done
    later = pool.number[FRACTION, l] > 0.0
    if later:
        carried(
            rule, constants.elastic, constants.line, constants.tan_mu, constants.total, pool.work, pool.base,
            pool.sliding, pool.place, pool.old, pool.change[l], pool.dz[l], pool.dslide[l], pool.geo, evolving,
            pool.carried, l,
        )  # fmt: skip
        if evolving:
            ratio = 13 in active_inputs(law)
            law_carried(
                pool.law_slope, pool.ratio_old, pool.place, pool.change[l], pool.carried, pool.carried_fabric, ratio, l
            )
    for row in range(nc):
        i = components[row]
        for col in range(nc):
            c = components[col]
            void = by_void if c < 3 else 0.0
            value = (pool.number[SIZE, l] if c == i else 0.0) - pool.slope[COLUMNS * i + VOID, l] * void
            pool.rhs[RHS * row + 1 + c, l] = value - (pool.carried[i, c] if later else 0.0)
            if evolving:
                value = pool.number[SIZE, l] * pool.law_slope[INPUTS * i + 19 + c, l]
                value -= pool.fabric_slope[COLUMNS * i + VOID, l] * void
                pool.rhs[RHS * (nc + row) + 1 + c, l] = value - (pool.carried_fabric[i, c] if later else 0.0)
        error = pool.strains[12 + i, l]
        if evolving:
            for k in range(6):
                error += pool.geo[6 * i + k, l] * (pool.y[6 + k, l] - pool.old[6 + k, l])
            pool.rhs[RHS * (nc + row) + 7, l] = pool.gain[i, l] - pool.gain_end[i, l]
        pool.rhs[RHS * row + 7, l] = error


@kernel
def newton_side(pool, components, evolving):
    """Fill the first right-hand side, minus the residual, of all lanes."""
    nc = components.shape[0]
    for row in range(nc):
        i = components[row]
        pool.rhs[RHS * row] = pool.strain[i] - pool.strains[i]
        if evolving:
            pool.rhs[RHS * (nc + row)] = pool.gain[i] - pool.y[6 + i] + pool.old[6 + i]


@kernel
def local_error(pool, components, evolving, l):
    """Return the estimated error of the sub-step: of the stress relative to its norm, or of the fabric."""
    nc = components.shape[0]
    stress, wrong, fabric = 0.0, 0.0, 0.0
    for row in range(nc):
        stress += pool.y[components[row], l] ** 2
        wrong += pool.rhs[RHS * row + 7, l] ** 2
        if evolving:
            fabric += pool.rhs[RHS * (nc + row) + 7, l] ** 2
    return max(np.sqrt(wrong) / (np.sqrt(stress) + STRESS_FLOOR), np.sqrt(fabric))


@kernel
def collect_change(pool, components, evolving, l):
    """Fill the derivative (13, 6) of the sub-step's end by the strain increment from the solved columns."""
    nc = components.shape[0]
    new = pool.new_change
    new[:] = 0.0
    done = pool.number[FRACTION, l] + pool.number[SIZE, l]
    for c in range(3):
        new[VOID, c] = -(1.0 + pool.y[VOID, l]) * done
    for row in range(nc):
        for col in range(nc):
            c = components[col]
            new[components[row], c] = pool.rhs[RHS * row + 1 + c, l]
            if evolving:
                new[6 + components[row], c] = pool.rhs[RHS * (nc + row) + 1 + c, l]


@kernel
def next_substep(constants, rule, pool, error, l):
    """Make the end of an accepted sub-step the start of the next one, which may be twice as long."""
    if pool.number[FRACTION, l] == 0.0:
        pool.change[l] = 0.0
        pool.dz[l] = 0.0
        pool.dslide[l] = 0.0
    advance(
        rule, constants.elastic, constants.line, constants.tan_mu, constants.total, pool.work, pool.base, pool.sliding,
        pool.place, pool.y, pool.change[l], pool.new_change, pool.dz[l], pool.dslide[l], l,
    )  # fmt: skip
    pool.change[l] = pool.new_change
    for i in range(13):
        pool.old[i, l] = pool.y[i, l]
    for i in range(9):
        pool.work[FORCE_OLD + i, l] = pool.work[FORCE + i, l]
    for a in range(pool.sliding.shape[0]):
        pool.sliding[a, l] = pool.sliding_new[a, l]
    pool.number[FRACTION, l] += pool.number[SIZE, l]
    size, fraction = pool.number[SIZE, l], pool.number[FRACTION, l]
    aligned = np.floor(fraction / (2.0 * size)) * 2.0 * size == fraction
    if error < 0.2 * constants.tolerance and aligned and fraction + 2.0 * size <= 1.0:
        pool.number[SIZE, l] = 2.0 * size
    begin(pool, l)


@kernel
def cut(constants, pool, factor, l):
    """Shorten the sub-step; return False when that is over."""
    pool.number[SIZE, l] *= factor
    begin(pool, l)
    return pool.number[SIZE, l] >= SMALLEST and pool.count[EVALUATIONS, l] < constants.max_evaluations


@kernel
def reason(constants, rule, pool, l):
    """Return the status code of a point that cannot go on."""
    if pool.count[EVALUATIONS, l] >= constants.max_evaluations:
        return status.WORK_LIMIT
    p = (pool.old[0, l] + pool.old[1, l] + pool.old[2, l]) / 3.0
    if critical_void_ratio(p, constants.line)[0] < 1.5 * FLOOR:
        return status.PRESSURE_RANGE
    least = 1.0
    for a in range(rule.weights.shape[0]):
        n = (rule.normals[a, 0], rule.normals[a, 1], rule.normals[a, 2])
        least = min(least, density(pool.work, n, l))
    return status.FABRIC_LIMIT if least < 0.01 else status.NO_CONVERGENCE


@kernel
def load(constants, rule, pool, data, point, l):
    """Put a point into a lane; return a status code if it cannot be tried."""
    stress, fabric, void_ratio, slide, force, strain = data
    pool.count[:, l] = 0
    pool.count[POINT, l] = point
    finite = np.isfinite(void_ratio[point])
    for i in range(6):
        pool.full[i, l], pool.old[i, l], pool.old[6 + i, l] = strain[point, i], stress[point, i], fabric[point, i]
        finite = finite and np.isfinite(strain[point, i]) and np.isfinite(stress[point, i]) and np.isfinite(fabric[point, i])
    pool.old[VOID, l] = void_ratio[point]
    pool.number[:, l] = 0.0
    pool.number[SIZE, l], pool.number[START, l] = 1.0, void_ratio[point]
    for a in range(slide.shape[1]):
        pool.sliding[a, l] = slide[point, a]
    if not constants.total:
        for a in range(slide.shape[1]):
            for i in range(3):
                pool.base[3 * a + i, l] = force[point, a, i]
    if not finite or not pool.old[0, l] + pool.old[1, l] + pool.old[2, l] > 0.0:
        return status.BAD_INPUT
    end = (1.0 + void_ratio[point]) * np.exp(-(strain[point, 0] + strain[point, 1] + strain[point, 2])) - 1.0
    if not (FLOOR < end < MAX_VOID_RATIO and FLOOR < void_ratio[point] < MAX_VOID_RATIO):
        return status.VOID_RATIO_RANGE
    start_force(constants.total, pool.old, pool.work, l)
    begin(pool, l)
    return status.OK


@kernel
def finish(constants, rule, pool, out, code, l):
    """Write a point's answer, or only its status."""
    stress, fabric, void_ratio, slide, force, tangent, statuses, errors, work, substeps = out
    point = pool.count[POINT, l]
    statuses[point] = code
    errors[point] = pool.number[ERROR, l]
    work[point] = pool.count[EVALUATIONS, l]
    substeps[point] = pool.count[SUBSTEPS, l]
    if code != status.OK:
        return
    for i in range(6):
        stress[point, i], fabric[point, i] = pool.y[i, l], pool.y[6 + i, l]
        for c in range(6):
            tangent[point, i, c] = pool.new_change[i, c]
    void_ratio[point] = pool.y[VOID, l]
    for a in range(slide.shape[1]):
        slide[point, a] = pool.sliding_new[a, l]
        if not constants.total:
            for i in range(3):
                total = pool.base[3 * a + i, l]
                for k in range(3):
                    total += pool.work[FORCE + 3 * i + k, l] * rule.normals[a, k]
                force[point, a, i] = total


@kernel
def fill(constants, rule, pool, data, out, following, stop, l):
    """Give a lane the next point that can be tried; return the number of the point after it."""
    pool.count[CODE, l] = IDLE
    while following < stop:
        code = load(constants, rule, pool, data, following, l)
        following += 1
        if code == status.OK:
            pool.count[CODE, l] = RETRY
            break
        finish(constants, rule, pool, out, code, l)
    return following


@kernel
def settle(law, constants, program, rule, pool, out, l):
    """Act on a lane's solved system; return True when its point is finished, one way or the other."""
    components, evolving = program.components, constants.evolving
    nc = components.shape[0]
    code = pool.count[CODE, l]
    if code == ITERATE:
        finite = True
        for row in range(nc):
            pool.step[components[row], l] = pool.rhs[RHS * row, l]
            finite = finite and np.isfinite(pool.rhs[RHS * row, l])
            if evolving:
                pool.step[6 + components[row], l] = pool.rhs[RHS * (nc + row), l]
                finite = finite and np.isfinite(pool.rhs[RHS * (nc + row), l])
        if finite:
            retry(pool, l, 1.0)
            return False
    elif code == CONVERGED:
        error = local_error(pool, components, evolving, l)
        if not error <= constants.tolerance:
            factor = 0.5
            while factor * factor * error > 0.8 * constants.tolerance and factor > 2.0**-6:
                factor *= 0.5
        if error <= constants.tolerance or pool.number[SIZE, l] * factor < SMALLEST:
            pool.number[ERROR, l] += error
            pool.count[SUBSTEPS, l] += 1
            collect_change(pool, components, evolving, l)
            if pool.number[FRACTION, l] + pool.number[SIZE, l] >= 1.0:
                finish(constants, rule, pool, out, status.OK, l)
                return True
            next_substep(constants, rule, pool, error, l)
            return False
        if cut(constants, pool, factor, l):
            return False
        finish(constants, rule, pool, out, reason(constants, rule, pool, l), l)
        return True
    if cut(constants, pool, 0.25, l):
        return False
    finish(constants, rule, pool, out, reason(constants, rule, pool, l), l)
    return True


@kernel
def integrate(law, constants, rule, program, pool, data, out, start, stop):
    """Integrate the points start…stop-1; see the module's docstring."""
    components, evolving = program.components, constants.evolving
    n = components.shape[0] * (2 if evolving else 1)
    following = start
    for l in range(LANES):
        following = fill(constants, rule, pool, data, out, following, stop, l)
    while True:
        active, solving, converged = False, False, False
        for l in range(LANES):
            active = active or pool.count[CODE, l] != IDLE
        if not active:
            return
        evaluate(law, constants, rule, program, pool)
        for l in range(LANES):
            if pool.count[CODE, l] != IDLE:
                code = judge(pool, program, constants, l)
                pool.count[CODE, l] = code
                solving = solving or code != RETRY
                converged = converged or code == CONVERGED
        if not solving:
            continue
        newton_side(pool, components, evolving)
        if converged and evolving:
            law_inputs(pool.inputs, pool.y, pool.old, pool.strain, pool.strains[6:12], pool.place, 1.0)
            increments(law, pool.inputs.reshape(-1), pool.gain_end.reshape(-1))
            if 13 in active_inputs(law):
                by_ratio(pool.law_slope.reshape(-1), pool.old.reshape(-1), pool.ratio_old.reshape(-1))
        for l in range(LANES):
            if pool.count[CODE, l] == CONVERGED:
                right_hand_sides(law, constants, rule, program, pool, l)
        equilibrate(pool.matrix, pool.rhs, n, RHS)
        factorise(pool.matrix, pool.pivot, n)
        solve(pool.matrix, pool.rhs, n, RHS)
        for l in range(LANES):
            code = pool.count[CODE, l]
            if code != IDLE and code != RETRY and settle(law, constants, program, rule, pool, out, l):
                following = fill(constants, rule, pool, data, out, following, stop, l)
            elif code != IDLE:
                pool.count[CODE, l] = RETRY
