"""Newton's iteration for one sub-step of one lane.

The sliding that a force needs grows without bound as the contact nears its friction limit, so a plain Newton
step from far inside the domain ends outside, and one from close to the limit hardly moves. The remedy is that of
interior-point methods: the slope of a contact is taken at an estimate of its sliding that comes from the last
linear step (see `contact`), and a step that leaves the domain is cut to where the first contact to fail still has a
fifth of its room. There is no other line search.
"""

import numpy as np

from ..lanes import inlined, kernel, spot
from .pool import CUT, EQUILIBRIUM, EVALUATIONS, ITERATE, ITERATIONS, TRIAL, TRIES
from .rows import (
    ACCEPTED,
    BEST,
    BY_VOID_STRAIN,
    FABRIC,
    FACTOR,
    FINAL,
    FRACTION,
    FRESH,
    FULL,
    LENGTH,
    MARGIN,
    NEWTON,
    NORM,
    OLD,
    PART,
    PORTION,
    STEP,
    TAKEN,
    VOID,
    VOID_START,
    Y,
)  # fmt: skip

NEWTON_TOLERANCE = 1e-8  #: of the residual strain before the last correction, relative to the sub-step
SMALL, QUADRATIC = 1e-5, 3e-4  #: the same if it fell by this factor in the last step: see `converged`
NEWTON_FLOOR = 2e-15  #: of the residual strain, absolute: the rounding of the sums
NEAR = 0.2  #: residual relative to the sub-step from which the next one is expected to be the last
STALLED = 1e-6  #: residual relative to the sub-step that is taken when it falls no more
MAX_ITERATIONS = 14
MAX_TRIES = 10  #: at one Newton step
MAX_STARTS = 4  #: places to start from
PULL, FURTHER = 0.005, 8.0  #: first pull toward the centre of the domain, and how it grows with the tries
KEPT_ROOM = 0.2  #: of the room to the friction limit that a step out of the domain may leave


@kernel
def begin(rows, counts, l):
    """Set the trial state of a new sub-step: the old stress and fabric, the void ratio of its end."""
    portion, fraction = rows[spot(PORTION, l)], rows[spot(FRACTION, l)]
    volume = rows[spot(FULL, l)] + rows[spot(FULL + 1, l)] + rows[spot(FULL + 2, l)]
    for i in range(6):
        rows[spot(PART + i, l)] = portion * rows[spot(FULL + i, l)]
    for i in range(12):
        rows[spot(Y + i, l)] = rows[spot(OLD + i, l)]
    specific = (1.0 + rows[spot(VOID_START, l)]) * np.exp(-(fraction + portion) * volume)
    rows[spot(Y + VOID, l)] = specific - 1.0
    rows[spot(BY_VOID_STRAIN, l)] = -specific * (fraction + portion)
    again(rows, counts, l)


@inlined
def again(rows, counts, l):
    """Begin to iterate from the trial state."""
    rows[spot(FACTOR, l)], rows[spot(FRESH, l)], rows[spot(TAKEN, l)] = 1.0, 1.0, 1.0
    rows[spot(BEST, l)], rows[spot(FINAL, l)] = np.inf, 0.0
    counts[ITERATIONS, l] = 0
    counts[TRIES, l] = 0


@kernel
def toward_centre(rows, l, keep):
    """Move the trial stress toward 3 p G, where no contact has a tangential force, keeping a part of the rest."""
    p = (rows[spot(OLD, l)] + rows[spot(OLD + 1, l)] + rows[spot(OLD + 2, l)]) / 3.0
    for i in range(6):
        centre = p * ((1.0 if i < 3 else 0.0) + 0.4 * rows[spot(Y + FABRIC + i, l)])
        rows[spot(Y + i, l)] = centre + keep * (rows[spot(OLD + i, l)] - centre)


@inlined
def place_trial(rows, l):
    """Set the trial state to a part of the last Newton step."""
    for i in range(12):
        rows[spot(Y + i, l)] = rows[spot(ACCEPTED + i, l)] + rows[spot(FACTOR, l)] * rows[spot(STEP + i, l)]


@kernel
def reach(pool, count, l):
    """Return the part of a step out of the domain to try next.

    The room tanφ_p f_n − f_t of a contact is concave along a step that does not change tanφ_p, so that what is left
    at the place where the chord vanishes is not negative.
    """
    part = 1.0
    for a in range(count):
        kept, tried = pool.guess[spot(6 * a, l)], pool.guess[spot(6 * a + 3, l)]
        if not tried > 0.0:
            part = min(part, (1.0 - KEPT_ROOM) / (1.0 - tried * kept))
    return part if 0.0 < part < 1.0 else 0.5


@kernel
def shorten(pool, count, l):
    """Set the next trial of a Newton step that left the domain."""
    pool.rows[spot(FACTOR, l)] *= reach(pool, count, l)
    pool.rows[spot(TAKEN, l)], pool.rows[spot(FINAL, l)] = 0.0, 0.0
    pool.counts[TRIES, l] += 1
    place_trial(pool.rows, l)


@inlined
def converged(norm, previous, length):
    """Return whether the last correction and the tangent are good enough at a residual.

    Where Newton converges quadratically the relative change of the Jacobian in the correction to come is about twice
    (norm/previous)², and so is what the correction leaves of the residual.
    """
    falling = norm <= SMALL * length and norm <= QUADRATIC * previous
    return falling or norm <= NEWTON_TOLERANCE * length + NEWTON_FLOOR


@inlined
def once_more(rows, l):
    """Ask for a full evaluation of the same state; estimates of the sliding stay what they were."""
    rows[spot(FINAL, l)], rows[spot(TAKEN, l)] = 1.0, 0.0
    return TRIAL


@inlined
def judge(constants, count, pool, l):
    """Return what a lane does with the state just evaluated; count: contact directions."""
    rows, counts = pool.rows, pool.counts
    counts[EVALUATIONS, l] += 1
    norm, best, length = rows[spot(NORM, l)], rows[spot(BEST, l)], rows[spot(LENGTH, l)]
    inside = rows[spot(MARGIN, l)] > 0.0 and np.isfinite(norm)
    if not inside:
        if counts[ITERATIONS, l] == 0:
            counts[TRIES, l] += 1
            if counts[TRIES, l] > MAX_STARTS:
                return CUT
            toward_centre(rows, l, 1.0 - PULL * FURTHER ** (counts[TRIES, l] - 1))
        else:
            shorten(pool, count, l)
        out_of_means = counts[TRIES, l] > MAX_TRIES or counts[EVALUATIONS, l] >= constants.max_evaluations
        return CUT if out_of_means else TRIAL
    stalled = norm <= STALLED * length + 10.0 * NEWTON_FLOOR and norm > 0.5 * best
    if converged(norm, best, length) or stalled:
        if rows[spot(FINAL, l)] == 0.0:
            return once_more(rows, l)
        return EQUILIBRIUM
    rows[spot(BEST, l)] = norm
    counts[TRIES, l] = 0
    counts[ITERATIONS, l] += 1
    if counts[ITERATIONS, l] > MAX_ITERATIONS or counts[EVALUATIONS, l] >= constants.max_evaluations:
        return CUT
    for i in range(12):
        rows[spot(ACCEPTED + i, l)] = rows[spot(Y + i, l)]
    return ITERATE


@inlined
def take_step(pool, components, evolving, l):
    """Set the trial state to the Newton step just solved; False if it is not finite."""
    rows, nc = pool.rows, components.shape[0]
    total = 0.0
    for row in range(nc):
        step = rows[spot(NEWTON + row, l)]
        rows[spot(STEP + components[row], l)] = step
        total += step
        if evolving:
            step = rows[spot(NEWTON + nc + row, l)]
            rows[spot(STEP + FABRIC + components[row], l)] = step
            total += step
    rows[spot(FACTOR, l)], rows[spot(TAKEN, l)], rows[spot(FRESH, l)] = 1.0, 1.0, 0.0
    rows[spot(FINAL, l)] = 1.0 if rows[spot(BEST, l)] <= NEAR * rows[spot(LENGTH, l)] else 0.0
    place_trial(rows, l)
    return np.isfinite(total)


@inlined
def correct(pool, components, evolving, l):
    """Add the last Newton step, which the residual of an equilibrium is still good for, to stress and fabric."""
    rows, nc = pool.rows, components.shape[0]
    for row in range(nc):
        rows[spot(Y + components[row], l)] += rows[spot(NEWTON + row, l)]
        if evolving:
            rows[spot(Y + FABRIC + components[row], l)] += rows[spot(NEWTON + nc + row, l)]
