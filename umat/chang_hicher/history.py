"""How the end of one sub-step depends on the whole strain increment, through where the sub-step began.

The tangent of an increment that was cut into sub-steps is the chain of their derivatives. Each lane carries
d(σ, F, e)/dΔε, dZ/dΔε and dλ_a/dΔε of the start of its current sub-step (six columns each); `carried` turns them into
the
right-hand side of the sub-step's linear system, `advance` moves them to its end. Plain loops over one lane: only
points that needed more than one sub-step pass here.
"""

import numpy as np

from ..fabric.law import scaled
from ..lanes import inlined, kernel, spot
from .balance import HALF_SQRT2, contact_density, critical_void_ratio, inverse_fabric, matrix, plain, times
from .contact import TINY
from .rows import (
    BY_FABRIC,
    BY_VOID,
    DILATANCY,
    FABRIC,
    FABRIC_MIDDLE,
    FORCE,
    FORCE_OLD,
    FRICTION,
    GEO,
    INVERSE,
    LAW_INPUTS,
    LAW_SLOPE,
    OLD,
    PLASTIC_GEO,
    PSI_P,
    RATIO_OLD,
    SCALED,
    SHARE,
    VOID,
    Y,
)  # fmt: skip


@inlined
def clear(a):
    """Set a matrix to zero."""
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            a[i, j] = 0.0


@inlined
def assign(a, b):
    """Copy a matrix."""
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            a[i, j] = b[i, j]


@kernel
def tensor(rows, first, l, out):
    """Fill a 3 × 3 matrix from six plain rows of lane l."""
    for i in range(3):
        out[i, i] = rows[spot(first + i, l)]
    out[1, 2] = out[2, 1] = rows[spot(first + 3, l)]
    out[0, 2] = out[2, 0] = rows[spot(first + 4, l)]
    out[0, 1] = out[1, 0] = rows[spot(first + 5, l)]


@kernel
def tensor_of_mandel(rows, first, l, out):
    """Fill a 3 × 3 matrix from six Mandel rows of lane l."""
    tensor(rows, first, l, out)
    for i in range(3):
        for j in range(3):
            out[i, j] *= 1.0 if i == j else HALF_SQRT2


@kernel
def column_tensor(change, first, c, out):
    """Fill a 3 × 3 matrix from six Mandel entries of column c."""
    for i in range(3):
        out[i, i] = change[first + i, c]
    out[1, 2] = out[2, 1] = HALF_SQRT2 * change[first + 3, c]
    out[0, 2] = out[2, 0] = HALF_SQRT2 * change[first + 4, c]
    out[0, 1] = out[1, 0] = HALF_SQRT2 * change[first + 5, c]


@kernel
def force_change(rows, change, total, l, sign, out, small):
    """Add to `out` (9, 6) the change of Z with the columns of `change` (13, 6): sign for the stress, + for the rest."""
    s, f, g, x = small[0], small[1], small[2], small[3]
    tensor(rows, SCALED, l, g)
    tensor_of_mandel(rows, Y, l, x)
    if not total:
        tensor_of_mandel(rows, OLD, l, f)
        for i in range(3):
            for j in range(3):
                x[i, j] -= f[i, j]
    for c in range(6):
        column_tensor(change, 0, c, s)
        column_tensor(change, 6, c, f)
        for k in range(3):
            for n in range(3):
                whole = 0.0
                for m in range(3):
                    slope = sign * s[k, m] + rows[spot(BY_VOID, l)] * x[k, m] * change[VOID, c]
                    for a in range(3):
                        slope -= 2.0 / 15.0 * rows[spot(BY_FABRIC + 3 * k + a, l)] * f[a, m]
                    whole += slope * g[m, n]
                out[3 * k + n, c] += whole


@kernel
def plane_change(rows, done, elastic, n, l, small):
    """Return the slip of one contact plane and dλ/dtanφ_p; fill the derivatives of its displacement.

    small: scratch; its matrices 4, 5, 6 become the derivatives of the displacement by the old and the new force, and of
    the plastic one by the old force; the rows of 7 hold the old and the new force, those of 8 become the direction of
    slip (zero where nothing slides) and dλ/df.
    """
    of_old, of_new, of_plastic = small[4], small[5], small[6]
    by_old, by_new, of_slide, q = small[7, 0], small[7, 1], small[8, 0], small[8, 1]
    t, h, u = small[9, 0], small[9, 1], small[9, 2]
    compliance, ease_t, ease_p = elastic
    fn, gn = 0.0, 0.0
    for i in range(3):
        fn += by_new[i] * n[i]
        gn += by_old[i] * n[i]
    gn = max(gn, 1e-30)
    ft2, um2 = TINY, TINY
    for i in range(3):
        t[i] = by_new[i] - fn * n[i]
        h[i] = by_old[i] - gn * n[i]
        u[i] = 0.5 * (t[i] + h[i])
        ft2 += t[i] * t[i]
        um2 += u[i] * u[i]
    ft, um = np.sqrt(ft2), np.sqrt(um2)
    tan_p, tan_d = rows[spot(FRICTION, l)], rows[spot(DILATANCY, l)]
    room = tan_p * fn - ft
    s, so = np.sqrt(fn), np.sqrt(gn)
    mid, ratio = 0.5 * (fn + gn), ft / fn
    c = compliance / (s + so)
    dc, dc_old = -0.5 / s * c / (s + so), -0.5 / so * c / (s + so)
    required = ease_p * compliance * tan_p * s * ft / room
    share = rows[spot(SHARE, l)]
    slip = share * max(required - done, 0.0)
    on = 1.0 if required > done else 0.0
    by_ratio = ease_p * compliance * tan_p * tan_p * s * (fn / room) ** 2
    by_tan = -on * ease_p * compliance * s * (ft / room) ** 2
    ratio_m = um / mid
    for i in range(3):
        q[i] = on * ((0.5 * required / fn - by_ratio * ratio / fn) * n[i] + by_ratio / fn * t[i] / ft)
        u[i] /= um
        of_slide[i] = share * on * (u[i] + (tan_d - ratio_m) * n[i])
    for i in range(3):
        e = (fn - gn) * n[i] + ease_t * (t[i] - h[i])
        for k in range(3):
            one = 1.0 if i == k else 0.0
            stiff = c * (n[i] * n[k] + ease_t * (one - n[i] * n[k]))
            turn = 0.5 * slip * ((one - n[i] * n[k] - u[i] * u[k]) / um - n[i] * (u[k] - ratio_m * n[k]) / mid)
            of_plastic[i, k] = turn
            of_old[i, k] = -stiff + e * n[k] * dc_old + turn
            of_new[i, k] = stiff + e * n[k] * dc + of_slide[i] * q[k] + turn
    return slip, by_tan


@kernel
def carried(rows, slide, base, rule, constants, change, dz, dslide, out, small, long, l):
    """Fill dε and dε^p (12, 6) through the start of the sub-step: `change` (13, 6), dz (9, 6), dslide (N, 6)."""
    normals, weights = rule.normals, rule.weights
    elastic, line, tan_mu = constants.elastic, constants.line, constants.tan_mu
    total, evolving = constants.total, constants.evolving
    sums, dz_new, dilate = long[:18], long[18:27], long[27]
    clear(sums)
    clear(dz_new)
    if not total:
        assign(dz_new, dz)
        force_change(rows, change, total, l, -1.0, dz_new, small)
    p = max((rows[spot(OLD, l)] + rows[spot(OLD + 1, l)] + rows[spot(OLD + 2, l)]) / 3.0, 1e-12)
    critical, slope = critical_void_ratio(p, line)
    of_old, of_new, of_plastic, of_slide, q = small[4], small[5], small[6], small[8, 0], small[8, 1]
    for c in range(6):
        dp = (change[0, c] + change[1, c] + change[2, c]) / 3.0
        dilate[c] = 0.5 * tan_mu / critical * (change[12, c] - rows[spot(OLD + VOID, l)] / critical * slope * dp)
    for a in range(weights.shape[0]):
        n = (normals[a, 0], normals[a, 1], normals[a, 2])
        w = weights[a] * density(rows, n, l)
        forces(rows, base, total, a, n, l, small)
        slip, _ = plane_change(rows, slide[spot(a, l)], elastic, n, l, small)
        for c in range(6):
            for i in range(3):
                plastic = -of_slide[i] * dslide[a, c] + slip * n[i] * dilate[c]
                whole = plastic
                for k in range(3):
                    df_old, df_new = 0.0, 0.0
                    for m in range(3):
                        df_old += dz[3 * k + m, c] * n[m]
                        df_new += dz_new[3 * k + m, c] * n[m]
                    whole += of_old[i, k] * df_old + of_new[i, k] * df_new
                    plastic += of_plastic[i, k] * (df_old + df_new) + of_slide[i] * q[k] * df_new
                for j in range(3):
                    sums[3 * i + j, c] += w * whole * n[j]
                    sums[9 + 3 * i + j, c] += w * plastic * n[j]
    project(rows, sums, l, out, small)
    for i in range(12 if evolving else 0):
        for c in range(6):
            for k in range(6):
                place = GEO + 6 * i + k if i < 6 else PLASTIC_GEO + 6 * (i - 6) + k
                out[i, c] += rows[spot(place, l)] * change[6 + k, c]


@inlined
def six_of(rows, first, l):
    """Return six numbers of lane l."""
    return (
        rows[spot(first, l)],
        rows[spot(first + 1, l)],
        rows[spot(first + 2, l)],
        rows[spot(first + 3, l)],
        rows[spot(first + 4, l)],
        rows[spot(first + 5, l)],
    )


@inlined
def start_force(rows, total, l):
    """Fill Z at the start of an increment: σ G⁻¹ / c(e), or nothing where forces are kept direction by direction."""
    for i in range(9):
        rows[spot(FORCE_OLD + i, l)] = 0.0
    if not total:
        return
    stress, fabric = six_of(rows, OLD, l), six_of(rows, OLD + FABRIC, l)
    inverse = inverse_fabric(plain(fabric))
    scale = 1.0 / contact_density(rows[spot(OLD + VOID, l)])[0]
    entries = times(matrix(plain(stress)), matrix(scaled(scale, inverse)))
    for i in range(9):
        rows[spot(FORCE_OLD + i, l)] = entries[i]


@inlined
def density(rows, n, l):
    """Return 1 + F_m : n n."""
    cross = (
        rows[spot(FABRIC_MIDDLE + 3, l)] * n[1] * n[2]
        + rows[spot(FABRIC_MIDDLE + 4, l)] * n[0] * n[2]
        + rows[spot(FABRIC_MIDDLE + 5, l)] * n[0] * n[1]
    )
    straight = (
        rows[spot(FABRIC_MIDDLE, l)] * n[0] ** 2
        + rows[spot(FABRIC_MIDDLE + 1, l)] * n[1] ** 2
        + rows[spot(FABRIC_MIDDLE + 2, l)] * n[2] ** 2
    )
    return 1.0 + straight + 2.0 * cross


@kernel
def forces(rows, base, total, a, n, l, small):
    """Fill a plane's force at the start and at the end of the sub-step."""
    before, new = small[7, 0], small[7, 1]
    for i in range(3):
        own = 0.0 if total else base[spot(3 * a + i, l)]
        before[i], new[i] = own, own
        for m in range(3):
            before[i] += rows[spot(FORCE_OLD + 3 * i + m, l)] * n[m]
            new[i] += rows[spot(FORCE + 3 * i + m, l)] * n[m]


@kernel
def project(rows, sums, l, out, small):
    """Fill the Mandel strains sym(D G_m⁻¹) of the total and the plastic sum, (12, 6)."""
    g, d = small[0], small[1]
    tensor(rows, INVERSE, l, g)
    for part in range(2):
        for c in range(6):
            for i in range(3):
                for j in range(3):
                    d[i, j] = 0.0
                    for k in range(3):
                        d[i, j] += sums[9 * part + 3 * i + k, c] * g[k, j]
            first = 6 * part
            for i in range(3):
                out[first + i, c] = d[i, i]
            out[first + 3, c] = HALF_SQRT2 * (d[1, 2] + d[2, 1])
            out[first + 4, c] = HALF_SQRT2 * (d[0, 2] + d[2, 0])
            out[first + 5, c] = HALF_SQRT2 * (d[0, 1] + d[1, 0])


@kernel
def law_carried(rows, change, strain_change, out, ratio, l):
    """Fill (6, 6): the derivative of F − F_o − ΔF through the start; strain_change: rows 6…11 the plastic strain's."""
    for i in range(6):
        row = LAW_SLOPE + LAW_INPUTS * i
        for c in range(6):
            dp = (change[0, c] + change[1, c] + change[2, c]) / 3.0
            total = rows[spot(row + 12, l)] * 0.5 * (change[12, c] - rows[spot(PSI_P, l)] * dp)
            for k in range(6):
                total += (
                    0.5 * rows[spot(row + k, l)] * change[6 + k, c] + 0.5 * rows[spot(row + 6 + k, l)] * change[k, c]
                )
                total += rows[spot(row + 25 + k, l)] * strain_change[6 + k, c]
                if ratio:
                    total -= rows[spot(RATIO_OLD + 6 * i + k, l)] * change[k, c]
            out[i, c] = -change[6 + i, c] - total


@kernel
def advance(rows, slide, base, rule, constants, change, new, dz, dslide, small, l):
    """Move dZ and dλ to the end of the sub-step, whose state depends on the increment through `new` (13, 6)."""
    normals, weights = rule.normals, rule.weights
    elastic, line, total = constants.elastic, constants.line, constants.total
    if total:
        clear(dz)
    else:
        force_change(rows, change, total, l, -1.0, dz, small)
    force_change(rows, new, total, l, 1.0, dz, small)
    p = max((rows[spot(Y, l)] + rows[spot(Y + 1, l)] + rows[spot(Y + 2, l)]) / 3.0, 1e-12)
    critical, slope = critical_void_ratio(p, line)
    tan_p = rows[spot(FRICTION, l)]
    q = small[8, 1]
    for a in range(weights.shape[0]):
        n = (normals[a, 0], normals[a, 1], normals[a, 2])
        forces(rows, base, total, a, n, l, small)
        slip, by_tan = plane_change(rows, slide[spot(a, l)], elastic, n, l, small)
        if slip > 0.0:
            for c in range(6):
                dp = (new[0, c] + new[1, c] + new[2, c]) / 3.0
                change_of_need = by_tan * tan_p * (slope * dp / critical - new[VOID, c] / rows[spot(Y + VOID, l)])
                for k in range(3):
                    for m in range(3):
                        change_of_need += q[k] * dz[3 * k + m, c] * n[m]
                dslide[a, c] += rows[spot(SHARE, l)] * (change_of_need - dslide[a, c])
