"""One point's way into a lane and out of it: loading, the answer, the refusal, the opened packing."""

import numpy as np

from .. import status
from ..lanes import inlined, kernel, spot
from .balance import FLOOR, MAX_VOID_RATIO, contact_density
from .history import start_force
from .iteration import begin
from .pool import EVALUATIONS, POINT, SUBSTEPS
from .rows import (
    CLOSING,
    ERROR,
    FABRIC,
    FORCE,
    FORCE_OLD,
    FRACTION,
    FULL,
    OLD,
    PORTION,
    RAISING,
    SHARE,
    STEP,
    VOID,
    VOID_START,
    Y,
)  # fmt: skip

LOOSEST = 1.5  #: void ratio for the stabilising tangent of a point, at most


@inlined
def old_pressure(rows, l):
    """Return the mean pressure at the start of the sub-step."""
    return (rows[spot(OLD, l)] + rows[spot(OLD + 1, l)] + rows[spot(OLD + 2, l)]) / 3.0


@kernel
def mean_force(constants, rule, pool, l):
    """Return the pressure that the normal forces at the start of the sub-step stand for, c ⟨f_n⟩ / 3.

    In the total form that is the mean pressure; in the rate form the two drift apart as F and e change.
    """
    rows, total = pool.rows, 0.0
    if constants.total:
        return old_pressure(rows, l)
    for a in range(rule.weights.shape[0]):
        for i in range(3):
            force = pool.base[spot(3 * a + i, l)]
            for k in range(3):
                force += rows[spot(FORCE_OLD + 3 * i + k, l)] * rule.normals[a, k]
            total += rule.weights[a] * force * rule.normals[a, i]
    return total * contact_density(rows[spot(OLD + VOID, l)])[0] / 3.0


@inlined
def load_contacts(constants, rule, pool, slip, force, point, l):
    """Put sliding and forces of a point into a lane, weightless directions like the first; return their sum."""
    total, count = 0.0, slip.shape[1]
    for a in range(rule.weights.shape[0]):
        own = a if a < count else 0
        total += slip[point, own]
        pool.slide[spot(a, l)] = slip[point, own]
        if not constants.total:
            for i in range(3):
                total += force[point, own, i]
                pool.base[spot(3 * a + i, l)] = force[point, own, i]
    return total


@inlined
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
    rows[spot(SHARE, l)], rows[spot(RAISING, l)] = 1.0, 0.0
    total += load_contacts(constants, rule, pool, slip, force, point, l)
    if not (np.isfinite(total) and stress[point, 0] + stress[point, 1] + stress[point, 2] > 0.0):
        return report(pool, out, status.BAD_INPUT, l)
    end = (1.0 + void_ratio[point]) * np.exp(-volume) - 1.0
    closed = (1.0 + void_ratio[point]) * np.exp(-gap[point]) - 1.0
    # a gap is no part of the packing; one that expands beyond the range may open on the way
    if not (end > FLOOR and FLOOR < closed < MAX_VOID_RATIO):
        return report(pool, out, status.VOID_RATIO_RANGE, l)
    start_force(rows, constants.total, l)
    for i in range(12):
        rows[spot(STEP + i, l)] = 0.0  # of the components that vanish nothing else is written
    if closing == 1.0:
        out[2][point], out[5][point] = end, gap[point] - volume
        elastic_open(constants, rows, out[6], point, l)
        return report(pool, out, status.OK, l)
    begin(pool.rows, pool.counts, l)
    return True


@inlined
def report(pool, out, code, l):
    """Write a point's status and the work spent on it; return False."""
    point = pool.counts[POINT, l]
    out[7][point], out[8][point] = code, pool.rows[spot(ERROR, l)]
    out[9][point], out[10][point] = pool.counts[EVALUATIONS, l], pool.counts[SUBSTEPS, l]
    return False


@kernel
def elastic_open(constants, rows, tangent, point, l):
    """Write the tangent of an open point: its stress is constant, so this is a stabilisation and has a name."""
    density = contact_density(min(rows[spot(OLD + VOID, l)], LOOSEST))[0]
    compliance, ease_t, _ = constants.elastic
    normal = 4.5 * compliance / np.sqrt(3.0 * constants.open_pressure / density) / density
    bulk, shear = 1.0 / normal, 1.0 / (normal * (2.0 / 15.0 + ease_t / 5.0))
    for i in range(6):
        for j in range(6):
            volumetric = bulk - shear / 3.0 if i < 3 and j < 3 else 0.0
            tangent[point, i, j] = constants.open_stiffness * (volumetric + (shear if i == j else 0.0))


@kernel
def open_point(constants, rule, pool, out, before, l):
    """Write the answer of a point that opens in this sub-step: the pressure falls to the open pressure and stays there.

    Stress becomes 3 p G, under which no contact has a tangential force; fabric and sliding stay what they were when the
    sub-step began, and the volumetric strain left is the gap. before: part of the sub-step that passes before it opens.
    """
    stress, fabric, void_ratio, slip, force, gap, tangent = out[:7]
    rows, point = pool.rows, pool.counts[POINT, l]
    p, volume = constants.open_pressure, rows[spot(FULL, l)] + rows[spot(FULL + 1, l)] + rows[spot(FULL + 2, l)]
    for i in range(6):
        fabric[point, i] = rows[spot(OLD + FABRIC + i, l)]
        stress[point, i] = p * ((1.0 if i < 3 else 0.0) + 0.4 * fabric[point, i])
    left = 1.0 - rows[spot(FRACTION, l)] - before * rows[spot(PORTION, l)]
    gap[point] = max(-left * volume, 0.0)
    void_ratio[point] = (1.0 + rows[spot(VOID_START, l)]) * np.exp(-volume) - 1.0
    for a in range(slip.shape[1]):
        slip[point, a] = pool.slide[spot(a, l)]
        if not constants.total:
            for i in range(3):
                force[point, a, i] = 3.0 * p / contact_density(rows[spot(OLD + VOID, l)])[0] * rule.normals[a, i]
    elastic_open(constants, rows, tangent, point, l)
    report(pool, out, status.OK, l)


@inlined
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
