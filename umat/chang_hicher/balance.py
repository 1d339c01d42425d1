"""Strain that a stress and a fabric need, and its derivative: the averages of [ZK Table 3, 15] over contact planes.

With G = I/3 + 2F/15, c(e) = 3 (13.28 − 8e) / (2π (1+e)) and forces f = Z n, the step's strain is
ε = sym(D G_m⁻¹), D = Σ w (1 + F_m:nn) δ(Z n) ⊗ n, where m is the middle of the step and

* total localisation:  Z = σ G⁻¹ / c(e), all at the end of the step: the stress average holds at all times;
* rate localisation:   Z = Z_o + (σ − σ_o) G_m⁻¹ / c(e_m): forces accumulate.

Derivatives, with H_{ik,jl} = Σ w(1+F_m:nn) ∂δ_i/∂f_k n_j n_l and T_{i,jab} = Σ w δ_i n_j n_a n_b:
dε = sym[(H:dZ + ½ T:dF + D_p dp + D_e de) G_m⁻¹ − (1/15) D G_m⁻¹ dF G_m⁻¹],
dZ = dσ G⁻¹/c − (2/15) Z dF G⁻¹ − Z (c'/c) de   (total; with Z − Z_o, G_m and halves in the rate form).
"""

import numpy as np

from ..fabric.law import dot, plus, scaled, six
from ..lanes import at, kernel, lanes
from .rows import (
    BY_FABRIC,
    BY_VOID,
    COLUMN_E,
    COLUMN_P,
    COLUMNS,
    D_DILATANCY,
    D_FRICTION,
    D_LATE,
    DILATANCY,
    E_DILATANCY,
    E_FRICTION,
    FABRIC,
    FABRIC_MIDDLE,
    FIRST,
    FORCE,
    FORCE_OLD,
    FRICTION,
    INVERSE,
    MARGIN,
    OLD,
    P_DILATANCY,
    P_FRICTION,
    PROJECTED,
    PSI,
    PSI_P,
    SCALED,
    VOID,
    C,
    Y,
)  # fmt: skip

SQRT2 = 2.0**0.5
HALF_SQRT2 = 0.5 * SQRT2
DENSITY = 3.0 / (2.0 * np.pi)  #: of c(e) = DENSITY (13.28 − 8 e) / (1 + e)
FLOOR = 0.02  #: least void ratio, and critical void ratio, for which the law is used
MAX_VOID_RATIO = 1.64  #: the contact density ∝ 13.28 − 8 e stays positive


@kernel
def inverse_fabric(xx, yy, zz, yz, xz, xy):
    """Return the inverse of G = I/3 + 2F/15 (plain components)."""
    a, b, c = 1.0 / 3.0 + 2.0 / 15.0 * xx, 1.0 / 3.0 + 2.0 / 15.0 * yy, 1.0 / 3.0 + 2.0 / 15.0 * zz
    d, e, f = 2.0 / 15.0 * yz, 2.0 / 15.0 * xz, 2.0 / 15.0 * xy
    ixx, iyy, izz = b * c - d * d, a * c - e * e, a * b - f * f
    iyz, ixz, ixy = e * f - a * d, d * f - b * e, d * e - c * f
    scale = 1.0 / np.maximum(a * ixx + f * ixy + e * ixz, 1e-30)
    return ixx * scale, iyy * scale, izz * scale, iyz * scale, ixz * scale, ixy * scale


@kernel
def contact_density(void_ratio):
    """Return c(e) = 2 m_V r³ and its derivative [ZK Table 3]."""
    denominator = 1.0 / (1.0 + void_ratio)
    c = DENSITY * (13.28 - 8.0 * void_ratio) * denominator
    return c, -DENSITY * 8.0 * denominator - c * denominator


@kernel
def critical_void_ratio(p, line):
    """Return e_c and its derivative by p (p over p_ref) [ZK Table 3]; line = (e_ref, λ_c, ξ)."""
    e_ref, slope, exponent = line
    power = slope * np.maximum(p, 1e-12) ** exponent
    return e_ref - power, -exponent * power / np.maximum(p, 1e-12)


@kernel
def geometry(rows, line, tan_mu, total, width):
    """Fill what the contact planes read and the geometry rows, from the trial state and the old one."""
    for l in lanes(width):
        a, b, c = rows[at(Y, l)], rows[at(Y + 1, l)], rows[at(Y + 2, l)]
        d, e, f = HALF_SQRT2 * rows[at(Y + 3, l)], HALF_SQRT2 * rows[at(Y + 4, l)], HALF_SQRT2 * rows[at(Y + 5, l)]
        fa, fb, fc = rows[at(Y + 6, l)], rows[at(Y + 7, l)], rows[at(Y + 8, l)]
        fd, fe, ff = HALF_SQRT2 * rows[at(Y + 9, l)], HALF_SQRT2 * rows[at(Y + 10, l)], HALF_SQRT2 * rows[at(Y + 11, l)]
        ma, mb, mc = (
            0.5 * (fa + rows[at(OLD + 6, l)]),
            0.5 * (fb + rows[at(OLD + 7, l)]),
            0.5 * (fc + rows[at(OLD + 8, l)]),
        )
        md = 0.5 * (fd + HALF_SQRT2 * rows[at(OLD + 9, l)])
        me = 0.5 * (fe + HALF_SQRT2 * rows[at(OLD + 10, l)])
        mf = 0.5 * (ff + HALF_SQRT2 * rows[at(OLD + 11, l)])
        rows[at(FABRIC_MIDDLE, l)], rows[at(FABRIC_MIDDLE + 1, l)], rows[at(FABRIC_MIDDLE + 2, l)] = ma, mb, mc
        rows[at(FABRIC_MIDDLE + 3, l)], rows[at(FABRIC_MIDDLE + 4, l)], rows[at(FABRIC_MIDDLE + 5, l)] = md, me, mf
        ga, gb, gc, gd, ge, gf = inverse_fabric(ma, mb, mc, md, me, mf)
        rows[at(INVERSE, l)], rows[at(INVERSE + 1, l)], rows[at(INVERSE + 2, l)] = ga, gb, gc
        rows[at(INVERSE + 3, l)], rows[at(INVERSE + 4, l)], rows[at(INVERSE + 5, l)] = gd, ge, gf
        # the stress (or its increment), the fabric and the density that make the forces
        void, void_old = rows[at(Y + 12, l)], rows[at(OLD + 12, l)]
        half = 1.0
        if total:
            ga, gb, gc, gd, ge, gf = inverse_fabric(fa, fb, fc, fd, fe, ff)
            density, d_density = contact_density(void)
        else:
            density, d_density = contact_density(0.5 * (void + void_old))
            half = 0.5
            a, b, c = a - rows[at(OLD, l)], b - rows[at(OLD + 1, l)], c - rows[at(OLD + 2, l)]
            d = d - HALF_SQRT2 * rows[at(OLD + 3, l)]
            e = e - HALF_SQRT2 * rows[at(OLD + 4, l)]
            f = f - HALF_SQRT2 * rows[at(OLD + 5, l)]
        scale = 1.0 / density
        ga, gb, gc, gd, ge, gf = ga * scale, gb * scale, gc * scale, gd * scale, ge * scale, gf * scale
        rows[at(SCALED, l)], rows[at(SCALED + 1, l)], rows[at(SCALED + 2, l)] = ga, gb, gc
        rows[at(SCALED + 3, l)], rows[at(SCALED + 4, l)], rows[at(SCALED + 5, l)] = gd, ge, gf
        z0, z1, z2 = a * ga + f * gf + e * ge, a * gf + f * gb + e * gd, a * ge + f * gd + e * gc
        z3, z4, z5 = f * ga + b * gf + d * ge, f * gf + b * gb + d * gd, f * ge + b * gd + d * gc
        z6, z7, z8 = e * ga + d * gf + c * ge, e * gf + d * gb + c * gd, e * ge + d * gd + c * gc
        k = half * density
        rows[at(BY_FABRIC, l)], rows[at(BY_FABRIC + 1, l)], rows[at(BY_FABRIC + 2, l)] = k * z0, k * z1, k * z2
        rows[at(BY_FABRIC + 3, l)], rows[at(BY_FABRIC + 4, l)], rows[at(BY_FABRIC + 5, l)] = k * z3, k * z4, k * z5
        rows[at(BY_FABRIC + 6, l)], rows[at(BY_FABRIC + 7, l)], rows[at(BY_FABRIC + 8, l)] = k * z6, k * z7, k * z8
        rows[at(BY_VOID, l)] = -half * d_density * scale
        if not total:
            z0, z1, z2, z3, z4, z5, z6, z7, z8 = mixed(
                (z0, z1, z2, z3, z4, z5, z6, z7, z8), 1.0, nine(rows, FORCE_OLD, l), 1.0
            )
        rows[at(FORCE, l)], rows[at(FORCE + 1, l)], rows[at(FORCE + 2, l)] = z0, z1, z2
        rows[at(FORCE + 3, l)], rows[at(FORCE + 4, l)], rows[at(FORCE + 5, l)] = z3, z4, z5
        rows[at(FORCE + 6, l)], rows[at(FORCE + 7, l)], rows[at(FORCE + 8, l)] = z6, z7, z8
    friction(rows, line, tan_mu, width)


@kernel
def friction(rows, line, tan_mu, width):
    """Fill tanφ_p (end), tanφ_d and ψ (middle) and their derivatives; start the margin with the law's own range."""
    for l in lanes(width):
        p = (rows[at(Y, l)] + rows[at(Y + 1, l)] + rows[at(Y + 2, l)]) / 3.0
        p_old = (rows[at(OLD, l)] + rows[at(OLD + 1, l)] + rows[at(OLD + 2, l)]) / 3.0
        void, void_old = rows[at(Y + 12, l)], rows[at(OLD + 12, l)]
        critical, slope = critical_void_ratio(p, line)
        critical_old, _ = critical_void_ratio(p_old, line)
        rows[at(MARGIN, l)] = np.minimum(np.minimum(critical - FLOOR, p), MAX_VOID_RATIO - void)
        critical, critical_old = np.maximum(critical, FLOOR), np.maximum(critical_old, FLOOR)
        i_void, i_critical = 1.0 / void, 1.0 / critical
        tan_p = critical * i_void * tan_mu
        tan_d = void * i_critical * tan_mu
        rows[at(FRICTION, l)] = tan_p
        rows[at(DILATANCY, l)] = 0.5 * (tan_d + void_old / critical_old * tan_mu)
        rows[at(P_FRICTION, l)], rows[at(P_DILATANCY, l)] = (
            tan_p * i_critical * slope,
            -0.5 * tan_d * i_critical * slope,
        )
        rows[at(E_FRICTION, l)], rows[at(E_DILATANCY, l)] = -tan_p * i_void, 0.5 * tan_d * i_void
        middle, slope = critical_void_ratio(0.5 * (p + p_old), line)
        rows[at(PSI, l)], rows[at(PSI_P, l)] = 0.5 * (void + void_old) - middle, slope


@kernel
def nine(rows, first, l):
    """Return nine rows as a tuple."""
    return (
        rows[at(first, l)], rows[at(first + 1, l)], rows[at(first + 2, l)],
        rows[at(first + 3, l)], rows[at(first + 4, l)], rows[at(first + 5, l)],
        rows[at(first + 6, l)], rows[at(first + 7, l)], rows[at(first + 8, l)],
    )  # fmt: skip


@kernel
def symmetric(rows, first, l):
    """Return six plain rows as the nine entries of a symmetric matrix."""
    xx, yy, zz = rows[at(first, l)], rows[at(first + 1, l)], rows[at(first + 2, l)]
    yz, xz, xy = rows[at(first + 3, l)], rows[at(first + 4, l)], rows[at(first + 5, l)]
    return (xx, xy, xz, xy, yy, yz, xz, yz, zz)


@kernel
def times(a, b):
    """Return the product of two 3 × 3 matrices."""
    return (
        a[0] * b[0] + a[1] * b[3] + a[2] * b[6],
        a[0] * b[1] + a[1] * b[4] + a[2] * b[7],
        a[0] * b[2] + a[1] * b[5] + a[2] * b[8],
        a[3] * b[0] + a[4] * b[3] + a[5] * b[6],
        a[3] * b[1] + a[4] * b[4] + a[5] * b[7],
        a[3] * b[2] + a[4] * b[5] + a[5] * b[8],
        a[6] * b[0] + a[7] * b[3] + a[8] * b[6],
        a[6] * b[1] + a[7] * b[4] + a[8] * b[7],
        a[6] * b[2] + a[7] * b[5] + a[8] * b[8],
    )


@kernel
def mandel(a):
    """Return the Mandel components of the symmetric part of a matrix; also of its gradient by a symmetric tensor."""
    return (
        a[0], a[4], a[8],
        HALF_SQRT2 * (a[5] + a[7]), HALF_SQRT2 * (a[2] + a[6]), HALF_SQRT2 * (a[1] + a[3]),
    )  # fmt: skip


@kernel
def store(rows, first, l, values):
    """Write six rows."""
    rows[at(first, l)], rows[at(first + 1, l)], rows[at(first + 2, l)] = values[0], values[1], values[2]
    rows[at(first + 3, l)], rows[at(first + 4, l)], rows[at(first + 5, l)] = values[3], values[4], values[5]


@kernel
def store_nine(rows, first, l, values):
    """Write nine rows."""
    rows[at(first, l)], rows[at(first + 1, l)], rows[at(first + 2, l)] = values[0], values[1], values[2]
    rows[at(first + 3, l)], rows[at(first + 4, l)], rows[at(first + 5, l)] = values[3], values[4], values[5]
    rows[at(first + 6, l)], rows[at(first + 7, l)], rows[at(first + 8, l)] = values[6], values[7], values[8]


@kernel
def transform(rows, stiffness, width):
    """Fill C_{ik,mn} = G_jm⁻¹ H_{ik,jl} SCALED_ln from the rows of H."""
    for ik in range(9):
        for l in lanes(width):
            c = times(
                times(symmetric(rows, INVERSE, l), symmetric(rows, stiffness + 6 * ik, l)), symmetric(rows, SCALED, l)
            )
            store_nine(rows, C + 9 * ik, l, c)


@kernel
def project(rows, displacement, strain, width):
    """Fill the strain sym(D G_m⁻¹), Mandel, and the matrix itself."""
    for l in lanes(width):
        product = times(nine(rows, displacement, l), symmetric(rows, INVERSE, l))
        store_nine(rows, PROJECTED, l, product)
        store(rows, strain, l, mandel(product))


@kernel
def friction_columns(rows, width):
    """Fill the derivatives of the strain by p and by e through the friction angles, and the first-order part."""
    for l in lanes(width):
        a, b = nine(rows, D_FRICTION, l), symmetric(rows, D_DILATANCY, l)
        g = symmetric(rows, INVERSE, l)
        store(rows, COLUMN_P, l, mandel(times(mixed(a, rows[at(P_FRICTION, l)], b, rows[at(P_DILATANCY, l)]), g)))
        store(rows, COLUMN_E, l, mandel(times(mixed(a, rows[at(E_FRICTION, l)], b, rows[at(E_DILATANCY, l)]), g)))
        store(rows, FIRST, l, mandel(times(nine(rows, D_LATE, l), g)))


@kernel
def mixed(a, x, b, y):
    """Return x a + y b of nine entries."""
    return (
        x * a[0] + y * b[0], x * a[1] + y * b[1], x * a[2] + y * b[2],
        x * a[3] + y * b[3], x * a[4] + y * b[4], x * a[5] + y * b[5],
        x * a[6] + y * b[6], x * a[7] + y * b[7], x * a[8] + y * b[8],
    )  # fmt: skip


@kernel
def by_force(rows, slope, i, j, row, share, total, evolving, width):
    """Fill one row of a slope: strain ij through the forces, by stress, by fabric (if it evolves) and by void ratio.

    share (C_{ik,jm} + C_{jk,im}) is the derivative by σ_km; the void ratio scales the forces as the stress does.
    """
    at_i, at_j = C + 27 * i + 3 * j, C + 27 * j + 3 * i
    for l in lanes(width):
        k0 = share * (rows[at(at_i, l)] + rows[at(at_j, l)])
        k1 = share * (rows[at(at_i + 1, l)] + rows[at(at_j + 1, l)])
        k2 = share * (rows[at(at_i + 2, l)] + rows[at(at_j + 2, l)])
        k3 = share * (rows[at(at_i + 9, l)] + rows[at(at_j + 9, l)])
        k4 = share * (rows[at(at_i + 10, l)] + rows[at(at_j + 10, l)])
        k5 = share * (rows[at(at_i + 11, l)] + rows[at(at_j + 11, l)])
        k6 = share * (rows[at(at_i + 18, l)] + rows[at(at_j + 18, l)])
        k7 = share * (rows[at(at_i + 19, l)] + rows[at(at_j + 19, l)])
        k8 = share * (rows[at(at_i + 20, l)] + rows[at(at_j + 20, l)])
        k = (k0, k1, k2, k3, k4, k5, k6, k7, k8)
        s = mandel(k)
        scale = dot(s, six(rows, Y, l))
        if not total:
            scale = scale - dot(s, six(rows, OLD, l))
        p = rows[at(COLUMN_P + row, l)] / 3.0
        store(rows, slope, l, (s[0] + p, s[1] + p, s[2] + p, s[3], s[4], s[5]))
        rows[at(slope + VOID, l)] = scale * rows[at(BY_VOID, l)] + rows[at(COLUMN_E + row, l)]
        if evolving:
            f = mandel(times(transposed(nine(rows, BY_FABRIC, l)), k))
            store(rows, slope + FABRIC, l, scaled(-2.0 / 15.0, f))


@kernel
def transposed(a):
    """Return the transpose of nine entries."""
    return (a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8])


@kernel
def by_density(rows, slope, geo, third, i, j, share, width):
    """Add to one row of a slope, and keep, the derivative by F through the density of contacts and through G_m⁻¹."""
    j0, j1, j2 = pair_row(0, j), pair_row(1, j), pair_row(2, j)
    i0, i1, i2 = pair_row(0, i), pair_row(1, i), pair_row(2, i)
    for l in lanes(width):
        gj = (rows[at(j0, l)], rows[at(j1, l)], rows[at(j2, l)])
        gi = (rows[at(i0, l)], rows[at(i1, l)], rows[at(i2, l)])
        ai, bi, ci = half_share(rows, third + 10 * i, gj, l)
        aj, bj, cj = half_share(rows, third + 10 * j, gi, l)
        di, dj = PROJECTED + 3 * i, PROJECTED + 3 * j
        pi = (rows[at(di, l)], rows[at(di + 1, l)], rows[at(di + 2, l)])
        pj = (rows[at(dj, l)], rows[at(dj + 1, l)], rows[at(dj + 2, l)])
        m = mandel(mixed(outer(pi, gj), 1.0, outer(pj, gi), 1.0))
        values = (
            share * (0.5 * (ai[0] + aj[0]) - m[0] / 15.0),
            share * (0.5 * (ai[1] + aj[1]) - m[1] / 15.0),
            share * (0.5 * (bi[0] + bj[0]) - m[2] / 15.0),
            share * (HALF_SQRT2 * (bi[1] + bj[1]) - m[3] / 15.0),
            share * (HALF_SQRT2 * (ci[0] + cj[0]) - m[4] / 15.0),
            share * (HALF_SQRT2 * (ci[1] + cj[1]) - m[5] / 15.0),
        )
        store(rows, geo, l, values)
        store(rows, slope + FABRIC, l, plus(six(rows, slope + FABRIC, l), values))


@kernel
def pair_row(q, j):
    """Return the row of G_m⁻¹'s entry q j."""
    return INVERSE + (q if q == j else 6 - q - j)


@kernel
def outer(a, b):
    """Return the nine entries a_i b_j."""
    return (a[0] * b[0], a[0] * b[1], a[0] * b[2], a[1] * b[0], a[1] * b[1], a[1] * b[2],
            a[2] * b[0], a[2] * b[1], a[2] * b[2])  # fmt: skip


@kernel
def half_share(rows, t, g, l):
    """Return Σ_q T_{q,ab} g_q as ((xx, yy), (zz, yz), (xz, xy)); T in the order of `planes.TRIPLE`."""
    x, y, z = g
    # xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz
    t0, t1, t2, t3, t4 = rows[at(t, l)], rows[at(t + 1, l)], rows[at(t + 2, l)], rows[at(t + 3, l)], rows[at(t + 4, l)]
    t5, t6, t7, t8, t9 = (
        rows[at(t + 5, l)], rows[at(t + 6, l)], rows[at(t + 7, l)], rows[at(t + 8, l)], rows[at(t + 9, l)],
    )  # fmt: skip
    return (
        (t0 * x + t1 * y + t2 * z, t3 * x + t6 * y + t7 * z),
        (t5 * x + t8 * y + t9 * z, t4 * x + t7 * y + t8 * z),
        (t2 * x + t4 * y + t5 * z, t1 * x + t3 * y + t4 * z),
    )


@kernel
def strain_and_slope(rows, displacement, stiffness, third, strain, slope, geo, total, evolving, width):
    """Fill a strain (all of it, or its plastic part) and its derivative, from the rows of its D, H and T."""
    project(rows, displacement, strain, width)
    transform(rows, stiffness, width)
    for row in range(6):
        i = row if row < 3 else (1 if row == 3 else 0)
        j = row if row < 3 else (2 if row < 5 else 1)
        share = 0.5 if row < 3 else HALF_SQRT2
        by_force(rows, slope + COLUMNS * row, i, j, row, share, total, evolving, width)
        if evolving:
            by_density(rows, slope + COLUMNS * row, geo + 6 * row, third, i, j, share, width)
