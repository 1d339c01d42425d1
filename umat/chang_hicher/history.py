"""How the end of one sub-step depends on the whole strain increment, through where the sub-step began.

The tangent of an increment that was cut into sub-steps is the chain of their derivatives. Each lane carries
d(σ, F, e)/dΔε, dZ/dΔε and dλ_a/dΔε of the start of its current sub-step (six columns each); `carried` turns them into the
right-hand side of the sub-step's linear system, `advance` moves them to its end. Plain loops over one lane: only
points that needed more than one sub-step pass here.
"""

import numpy as np

from ..fabric.law import INPUTS
from ..lanes import kernel
from .balance import BY_FABRIC, BY_VOID, HALF_SQRT2, INVERSE, PSI_P, SCALED, contact_density, critical_void_ratio, inverse_fabric
from .contact import DILATANCY, FABRIC, FORCE, FORCE_OLD, FRICTION, TINY


@kernel
def tensor(rows, first, l, out, factor):
    """Fill a 3 × 3 matrix from six symmetric rows of lane l; factor is what turns the stored shear into a component."""
    for i in range(3):
        out[i, i] = rows[first + i, l]
    out[1, 2] = out[2, 1] = factor * rows[first + 3, l]
    out[0, 2] = out[2, 0] = factor * rows[first + 4, l]
    out[0, 1] = out[1, 0] = factor * rows[first + 5, l]


@kernel
def column_tensor(change, first, c, out):
    """Fill a 3 × 3 matrix from six Mandel entries of column c."""
    for i in range(3):
        out[i, i] = change[first + i, c]
    out[1, 2] = out[2, 1] = HALF_SQRT2 * change[first + 3, c]
    out[0, 2] = out[2, 0] = HALF_SQRT2 * change[first + 4, c]
    out[0, 1] = out[1, 0] = HALF_SQRT2 * change[first + 5, c]


@kernel
def force_change(change, place, l, sign, out):
    """Add to `out` (9, 6) the change of Z with the columns of `change` (13, 6): sign for the stress, + for the rest."""
    s, f, g = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    tensor(place, SCALED, l, g, 1.0)
    for c in range(6):
        column_tensor(change, 0, c, s)
        column_tensor(change, 6, c, f)
        for k in range(3):
            for n in range(3):
                total = place[BY_VOID + 3 * k + n, l] * change[12, c]
                for m in range(3):
                    slope = sign * s[k, m]
                    for a in range(3):
                        slope -= 2.0 / 15.0 * place[BY_FABRIC + 3 * k + a, l] * f[a, m]
                    total += slope * g[m, n]
                out[3 * k + n, c] += total


@kernel
def plane_change(work, before, by_old, by_new, elastic, n, l, of_old, of_new, of_slide, of_plastic):
    """Return slip and the derivatives of one contact plane by its old force, new force, sliding and dilatancy.

    of_old, of_new: (3, 3) of the total displacement; of_plastic (3, 3): of the plastic one by the old force (the half turn
    of the middle direction); of_slide: (3,) the direction of slip where the plane slides, else zero;
    by_old, by_new: the forces, (3,). Also returned: dλ/df (3,) and dλ/dtanφ_p.
    """
    compliance, ease_t, ease_p, gap = elastic
    fn, gn = 0.0, 0.0
    for i in range(3):
        fn += by_new[i] * n[i]
        gn += by_old[i] * n[i]
    gn = max(gn, 1e-30)
    ft2, um2 = TINY, TINY
    t, h, u = np.zeros(3), np.zeros(3), np.zeros(3)
    for i in range(3):
        t[i] = by_new[i] - fn * n[i]
        h[i] = by_old[i] - gn * n[i]
        u[i] = 0.5 * (t[i] + h[i])
        ft2 += t[i] * t[i]
        um2 += u[i] * u[i]
    ft, um = np.sqrt(ft2), np.sqrt(um2)
    tan_p, tan_d = work[FRICTION, l], work[DILATANCY, l]
    room = tan_p * fn - ft
    s, so = np.sqrt(fn), np.sqrt(gn)
    mid, ratio = 0.5 * (fn + gn), ft / fn
    opening, shape = gap / (s * so) ** 3, fn + s * so + gn
    easy = compliance / (s + so)
    c = easy * (1.0 + opening * shape)
    dc = 0.5 / s * (-c / (s + so) + easy * opening * (2.0 * s + so - 3.0 * shape / s))
    dc_old = 0.5 / so * (-c / (s + so) + easy * opening * (2.0 * so + s - 3.0 * shape / so))
    required = ease_p * compliance * tan_p * s * ft / room
    slip = max(required - before, 0.0)
    on = 1.0 if required > before else 0.0
    by_ratio = ease_p * compliance * tan_p * tan_p * s * (fn / room) ** 2
    by_tan = -on * ease_p * compliance * s * (ft / room) ** 2
    q = np.zeros(3)
    ratio_m = um / mid
    for i in range(3):
        q[i] = on * ((0.5 * required / fn - by_ratio * ratio / fn) * n[i] + by_ratio / fn * t[i] / ft)
        u[i] /= um
        of_slide[i] = on * (u[i] + (tan_d - ratio_m) * n[i])
    for i in range(3):
        e = (fn - gn) * n[i] + ease_t * (t[i] - h[i])
        for k in range(3):
            one = 1.0 if i == k else 0.0
            stiff = c * (n[i] * n[k] + ease_t * (one - n[i] * n[k]))
            turn = 0.5 * slip * ((one - n[i] * n[k] - u[i] * u[k]) / um - n[i] * (u[k] - ratio_m * n[k]) / mid)
            of_plastic[i, k] = turn
            of_old[i, k] = -stiff + e * n[k] * dc_old + turn
            of_new[i, k] = stiff + e * n[k] * dc + of_slide[i] * q[k] + turn
    return slip, q, by_tan


@kernel
def carried(rule, elastic, line, tan_mu, total, work, base, sliding, place, old, change, dz, dslide, geo, evolving, out, l):
    """Fill dε and dε^p (12, 6) through the start of the sub-step, at fixed end: `change` (13, 6), dz (9, 6), dslide (N, 6)."""
    normals, weights, _ = rule
    sums = np.zeros((18, 6))
    dz_new = np.zeros((9, 6))
    if not total:
        dz_new[:] = dz
        force_change(change, place, l, -1.0, dz_new)
    p = max((old[0, l] + old[1, l] + old[2, l]) / 3.0, 1e-12)
    critical, slope = critical_void_ratio(p, line)
    of_old, of_new, of_plastic = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    of_slide, new, before = np.zeros(3), np.zeros(3), np.zeros(3)
    dilate = np.zeros(6)
    for c in range(6):
        dp = (change[0, c] + change[1, c] + change[2, c]) / 3.0
        dilate[c] = 0.5 * tan_mu / critical * (change[12, c] - old[12, l] / critical * slope * dp)
    for a in range(weights.shape[0]):
        n = (normals[a, 0], normals[a, 1], normals[a, 2])
        w = weights[a] * density(work, n, l)
        forces(work, base, total, a, n, l, before, new)
        slip, q, by_tan = plane_change(
            work, sliding[a, l], before, new, elastic, n, l, of_old, of_new, of_slide, of_plastic
        )
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
    project(sums, place, l, out)
    for i in range(12 if evolving else 0):
        for c in range(6):
            for k in range(6):
                out[i, c] += geo[6 * i + k, l] * change[6 + k, c]


@kernel
def start_force(total, old, work, l):
    """Fill Z at the start of an increment: σ G⁻¹ / c(e), or nothing where forces are kept direction by direction."""
    for i in range(9):
        work[FORCE_OLD + i, l] = 0.0
    if not total:
        return
    h = HALF_SQRT2
    a, b, c = old[0, l], old[1, l], old[2, l]
    d, e, f = h * old[3, l], h * old[4, l], h * old[5, l]
    ga, gb, gc, gd, ge, gf = inverse_fabric(
        old[6, l], old[7, l], old[8, l], h * old[9, l], h * old[10, l], h * old[11, l]
    )
    scale = 1.0 / contact_density(old[12, l])[0]
    rows = (a * ga + f * gf + e * ge, a * gf + f * gb + e * gd, a * ge + f * gd + e * gc,
            f * ga + b * gf + d * ge, f * gf + b * gb + d * gd, f * ge + b * gd + d * gc,
            e * ga + d * gf + c * ge, e * gf + d * gb + c * gd, e * ge + d * gd + c * gc)  # fmt: skip
    for i in range(9):
        work[FORCE_OLD + i, l] = rows[i] * scale


@kernel
def density(work, n, l):
    """Return 1 + F_m : n n."""
    cross = work[FABRIC + 3, l] * n[1] * n[2] + work[FABRIC + 4, l] * n[0] * n[2] + work[FABRIC + 5, l] * n[0] * n[1]
    straight = work[FABRIC, l] * n[0] ** 2 + work[FABRIC + 1, l] * n[1] ** 2 + work[FABRIC + 2, l] * n[2] ** 2
    return 1.0 + straight + 2.0 * cross


@kernel
def forces(work, base, total, a, n, l, before, new):
    """Fill a plane's force at the start and at the end of the sub-step."""
    for i in range(3):
        own = 0.0 if total else base[3 * a + i, l]
        before[i], new[i] = own, own
        for m in range(3):
            before[i] += work[FORCE_OLD + 3 * i + m, l] * n[m]
            new[i] += work[FORCE + 3 * i + m, l] * n[m]


@kernel
def project(sums, place, l, out):
    """Fill the Mandel strains sym(D G_m⁻¹) of the total and the plastic sum, (12, 6)."""
    g = np.zeros((3, 3))
    tensor(place, INVERSE, l, g, 1.0)
    for part in range(2):
        for c in range(6):
            d = np.zeros((3, 3))
            for i in range(3):
                for j in range(3):
                    for k in range(3):
                        d[i, j] += sums[9 * part + 3 * i + k, c] * g[k, j]
            first = 6 * part
            for i in range(3):
                out[first + i, c] = d[i, i]
            out[first + 3, c] = HALF_SQRT2 * (d[1, 2] + d[2, 1])
            out[first + 4, c] = HALF_SQRT2 * (d[0, 2] + d[2, 0])
            out[first + 5, c] = HALF_SQRT2 * (d[0, 1] + d[1, 0])


@kernel
def law_carried(slope, ratio_old, place, change, strain_change, out, ratio, l):
    """Fill (6, 6): the derivative of F − F_o − ΔF through the start; strain_change: rows 6…11 the plastic strain's."""
    for i in range(6):
        row = INPUTS * i
        for c in range(6):
            dp = (change[0, c] + change[1, c] + change[2, c]) / 3.0
            total = slope[row + 12, l] * 0.5 * (change[12, c] - place[PSI_P, l] * dp)
            for k in range(6):
                total += 0.5 * slope[row + k, l] * change[6 + k, c] + 0.5 * slope[row + 6 + k, l] * change[k, c]
                total += slope[row + 25 + k, l] * strain_change[6 + k, c]
                if ratio:
                    total -= ratio_old[6 * i + k, l] * change[k, c]
            out[i, c] = -change[6 + i, c] - total


@kernel
def advance(rule, elastic, line, tan_mu, total, work, base, sliding, place, y, change, new, dz, dslide, l):
    """Move dZ and dλ to the end of the sub-step, whose state depends on the increment through `new` (13, 6)."""
    normals, weights, _ = rule
    if total:
        dz[:] = 0.0
        force_change(new, place, l, 1.0, dz)
    else:
        force_change(change, place, l, -1.0, dz)
        force_change(new, place, l, 1.0, dz)
    p = max((y[0, l] + y[1, l] + y[2, l]) / 3.0, 1e-12)
    critical, slope = critical_void_ratio(p, line)
    tan_p = work[FRICTION, l]
    of_old, of_new, of_plastic = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    of_slide, after, before = np.zeros(3), np.zeros(3), np.zeros(3)
    for a in range(weights.shape[0]):
        n = (normals[a, 0], normals[a, 1], normals[a, 2])
        forces(work, base, total, a, n, l, before, after)
        slip, q, by_tan = plane_change(
            work, sliding[a, l], before, after, elastic, n, l, of_old, of_new, of_slide, of_plastic
        )
        if slip > 0.0:
            for c in range(6):
                dp = (new[0, c] + new[1, c] + new[2, c]) / 3.0
                dslide[a, c] = by_tan * tan_p * (slope * dp / critical - new[12, c] / y[12, l])
                for k in range(3):
                    for m in range(3):
                        dslide[a, c] += q[k] * dz[3 * k + m, c] * n[m]
