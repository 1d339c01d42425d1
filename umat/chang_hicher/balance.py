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

from ..lanes import at, kernel, lanes
from .contact import (
    BASE,
    DILATANCY,
    FABRIC,
    FORCE,
    FORCE_OLD,
    FRICTION,
    GROUP,
    MARGIN,
    add_moments,
    contact_plane,
)
from .programs import (
    COLUMNS,
    D,
    D_DILATANCY,
    D_FIRST,
    D_FRICTION,
    D_PLASTIC,
    H,
    H_PLASTIC,
    T,
    T_PLASTIC,
)

SQRT2 = 2.0**0.5
HALF_SQRT2 = 0.5 * SQRT2
DENSITY = 3.0 / (2.0 * np.pi)  #: of m_V r³ 2 = DENSITY (13.28 - 8 e) / (1 + e)
FLOOR = 0.02  #: least critical void ratio for which the law is used

# rows of the unknowns and of the start of the step: stress, fabric (Mandel), void ratio
STRESS, FABRIC_Y, VOID, STATE_ROWS = 0, 6, 12, 13
# rows of the geometry: G_m⁻¹ (6), G_s⁻¹/c_s (6), c_s Z for dF (9), Z for de (9), and the derivatives of the friction angles:
INVERSE, SCALED, BY_FABRIC, BY_VOID, P_FRICTION, P_DILATANCY, E_FRICTION, E_DILATANCY, PSI, PSI_P, GEOMETRY_ROWS = (
    0, 6, 12, 21, 30, 31, 32, 33, 34, 35, 36,
)  # fmt: skip


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
def geometry(y, old, work, place, line, tan_mu, total):
    """Fill the workspace of the contact planes and the geometry rows from the trial state y and the old one."""
    for l in lanes():
        a, b, c = y[at(0, l)], y[at(1, l)], y[at(2, l)]
        d, e, f = HALF_SQRT2 * y[at(3, l)], HALF_SQRT2 * y[at(4, l)], HALF_SQRT2 * y[at(5, l)]
        fa, fb, fc = y[at(6, l)], y[at(7, l)], y[at(8, l)]
        fd, fe, ff = HALF_SQRT2 * y[at(9, l)], HALF_SQRT2 * y[at(10, l)], HALF_SQRT2 * y[at(11, l)]
        ma, mb, mc = 0.5 * (fa + old[at(6, l)]), 0.5 * (fb + old[at(7, l)]), 0.5 * (fc + old[at(8, l)])
        md = 0.5 * (fd + HALF_SQRT2 * old[at(9, l)])
        me = 0.5 * (fe + HALF_SQRT2 * old[at(10, l)])
        mf = 0.5 * (ff + HALF_SQRT2 * old[at(11, l)])
        work[at(20, l)], work[at(21, l)], work[at(22, l)] = ma, mb, mc
        work[at(23, l)], work[at(24, l)], work[at(25, l)] = md, me, mf
        ga, gb, gc, gd, ge, gf = inverse_fabric(ma, mb, mc, md, me, mf)
        place[at(0, l)], place[at(1, l)], place[at(2, l)] = ga, gb, gc
        place[at(3, l)], place[at(4, l)], place[at(5, l)] = gd, ge, gf
        # the stress (or its increment), the fabric and the density that make the forces
        void, void_old = y[at(12, l)], old[at(12, l)]
        half = 1.0
        if total:
            ga, gb, gc, gd, ge, gf = inverse_fabric(fa, fb, fc, fd, fe, ff)
            density, d_density = contact_density(void)
        else:
            density, d_density = contact_density(0.5 * (void + void_old))
            half = 0.5
            a, b, c = a - old[at(0, l)], b - old[at(1, l)], c - old[at(2, l)]
            d = d - HALF_SQRT2 * old[at(3, l)]
            e = e - HALF_SQRT2 * old[at(4, l)]
            f = f - HALF_SQRT2 * old[at(5, l)]
        scale = 1.0 / density
        ga, gb, gc, gd, ge, gf = ga * scale, gb * scale, gc * scale, gd * scale, ge * scale, gf * scale
        place[at(6, l)], place[at(7, l)], place[at(8, l)] = ga, gb, gc
        place[at(9, l)], place[at(10, l)], place[at(11, l)] = gd, ge, gf
        z0, z1, z2 = a * ga + f * gf + e * ge, a * gf + f * gb + e * gd, a * ge + f * gd + e * gc
        z3, z4, z5 = f * ga + b * gf + d * ge, f * gf + b * gb + d * gd, f * ge + b * gd + d * gc
        z6, z7, z8 = e * ga + d * gf + c * ge, e * gf + d * gb + c * gd, e * ge + d * gd + c * gc
        k = half * density
        place[at(12, l)], place[at(13, l)], place[at(14, l)] = k * z0, k * z1, k * z2
        place[at(15, l)], place[at(16, l)], place[at(17, l)] = k * z3, k * z4, k * z5
        place[at(18, l)], place[at(19, l)], place[at(20, l)] = k * z6, k * z7, k * z8
        k = -half * d_density * scale
        place[at(21, l)], place[at(22, l)], place[at(23, l)] = k * z0, k * z1, k * z2
        place[at(24, l)], place[at(25, l)], place[at(26, l)] = k * z3, k * z4, k * z5
        place[at(27, l)], place[at(28, l)], place[at(29, l)] = k * z6, k * z7, k * z8
        if not total:
            z0, z1, z2 = z0 + work[at(9, l)], z1 + work[at(10, l)], z2 + work[at(11, l)]
            z3, z4, z5 = z3 + work[at(12, l)], z4 + work[at(13, l)], z5 + work[at(14, l)]
            z6, z7, z8 = z6 + work[at(15, l)], z7 + work[at(16, l)], z8 + work[at(17, l)]
        work[at(0, l)], work[at(1, l)], work[at(2, l)] = z0, z1, z2
        work[at(3, l)], work[at(4, l)], work[at(5, l)] = z3, z4, z5
        work[at(6, l)], work[at(7, l)], work[at(8, l)] = z6, z7, z8
    friction(y, old, work, place, line, tan_mu)


@kernel
def friction(y, old, work, place, line, tan_mu):
    """Fill tanφ_p (end), tanφ_d and ψ (middle) and their derivatives; start the margin with the law's own range."""
    for l in lanes():
        p = (y[at(0, l)] + y[at(1, l)] + y[at(2, l)]) / 3.0
        p_old = (old[at(0, l)] + old[at(1, l)] + old[at(2, l)]) / 3.0
        void, void_old = y[at(12, l)], old[at(12, l)]
        critical, slope = critical_void_ratio(p, line)
        critical_old, _ = critical_void_ratio(p_old, line)
        work[at(26, l)] = np.minimum(critical - FLOOR, p)
        critical, critical_old = np.maximum(critical, FLOOR), np.maximum(critical_old, FLOOR)
        i_void, i_critical = 1.0 / void, 1.0 / critical
        tan_p = critical * i_void * tan_mu
        tan_d = void * i_critical * tan_mu
        work[at(18, l)] = tan_p
        work[at(19, l)] = 0.5 * (tan_d + void_old / critical_old * tan_mu)
        place[at(30, l)], place[at(31, l)] = tan_p * i_critical * slope, -0.5 * tan_d * i_critical * slope
        place[at(32, l)], place[at(33, l)] = -tan_p * i_void, 0.5 * tan_d * i_void
        middle, slope = critical_void_ratio(0.5 * (p + p_old), line)
        place[at(34, l)], place[at(35, l)] = 0.5 * (void + void_old) - middle, slope


@kernel
def contract(out, coefficient, a, b, terms):
    """Add coefficient · a · b to the rows of `out`, term by term."""
    for t in range(terms.shape[0]):
        k = coefficient[t]
        target, first, second = out[terms[t, 0]], a[terms[t, 1]], b[terms[t, 2]]
        for l in lanes():
            target[l] += k * first[l] * second[l]


@kernel
def contract_plain(out, a, b, terms):
    """Add a · b to the rows of `out`, term by term."""
    for t in range(terms.shape[0]):
        target, first, second = out[terms[t, 0]], a[terms[t, 1]], b[terms[t, 2]]
        for l in lanes():
            target[l] += first[l] * second[l]


@kernel
def spread(out, coefficient, a, terms):
    """Add coefficient · a to the rows of `out`, term by term."""
    for t in range(terms.shape[0]):
        k = coefficient[t]
        target, first = out[terms[t, 0]], a[terms[t, 1]]
        for l in lanes():
            target[l] += k * first[l]


@kernel
def sum_planes(sums, work, base, sliding, sliding_new, buffer, rule, elastic, program, total, evolving):
    """Sum displacement, its moments and derivatives over all contact planes."""
    normals, weights, table = rule
    sums[:] = 0.0
    flat = work.reshape(-1)
    for first in range(0, weights.shape[0], GROUP):
        for k in range(GROUP):
            a = first + k
            if not total:
                work[BASE] = base[3 * a]
                work[BASE + 1] = base[3 * a + 1]
                work[BASE + 2] = base[3 * a + 2]
            n = (normals[a, 0], normals[a, 1], normals[a, 2])
            contact_plane(flat, sliding[a], sliding_new[a], buffer[k].reshape(-1), n, weights[a], elastic)
        add_moments(sums, buffer, table, first, program.moments)
        if evolving:
            add_moments(sums, buffer, table, first, program.moments_fabric)


@kernel
def combine(out, a, by_a, b, by_b):
    """Set nine rows of `out` to a·by_a + b·by_b, b a symmetric tensor in six rows."""
    for i in range(3):
        for j in range(3):
            k = i if i == j else 6 - i - j
            target, first, second = out[3 * i + j], a[3 * i + j], b[k]
            for l in lanes():
                target[l] = first[l] * by_a[l] + second[l] * by_b[l]


@kernel
def strain_and_slope(strain, slope, geo, scratch, sums, place, program, rows, evolving):
    """Fill the step's strain (6 rows) and its derivative by stress, fabric and void ratio (6 × 13 rows).

    rows: first rows in `sums` of D, H and T, and of the friction's and dilatancy's D (the same for total and plastic);
    geo: 6 × 6 rows, the part of the derivative by the fabric that comes from the density of contacts and G_m;
    scratch: 9 + 9 + 81 + 81 rows.
    """
    row_d, row_h, row_t = rows
    nine, product = scratch[:9], scratch[9:18]
    b, c = scratch[18:99], scratch[99:180]
    inverse, scaled = place[INVERSE : INVERSE + 6], place[SCALED : SCALED + 6]
    displacement, stiffness = sums[row_d : row_d + 9], sums[row_h : row_h + 54]
    strain[:] = 0.0
    slope[:] = 0.0
    scratch[:] = 0.0
    contract(strain, program.strain_coefficient, displacement, inverse, program.strain)
    contract_plain(b, stiffness, inverse, program.left)
    contract_plain(c, b, scaled, program.right)
    if evolving:
        density = sums[row_t : row_t + 30]
        contract_plain(product, displacement, inverse, program.product)
        contract(slope, program.by_density_coefficient, density, inverse, program.by_density)
        contract(slope, program.by_inverse_coefficient, product, inverse, program.by_inverse)
        for i in range(6):
            geo[6 * i : 6 * i + 6] = slope[COLUMNS * i + 6 : COLUMNS * i + 12]
        contract(slope, program.by_force_coefficient, c, place[BY_FABRIC : BY_FABRIC + 9], program.by_force)
    spread(slope, program.by_stress_coefficient, c, program.by_stress)
    # through the friction angles: by p, then by e
    column = scratch[18:24]
    column[:] = 0.0
    combine(nine, sums[D_FRICTION : D_FRICTION + 9], place[P_FRICTION], sums[D_DILATANCY : D_DILATANCY + 6], place[P_DILATANCY])
    contract(column, program.strain_coefficient, nine, inverse, program.strain)
    for i in range(6):
        for k in range(3):
            target, entry = slope[COLUMNS * i + k], column[i]
            for l in lanes():
                target[l] += entry[l] / 3.0
    column[:] = 0.0
    combine(nine, sums[D_FRICTION : D_FRICTION + 9], place[E_FRICTION], sums[D_DILATANCY : D_DILATANCY + 6], place[E_DILATANCY])
    contract_plain(nine, stiffness, place[BY_VOID : BY_VOID + 9], program.by_rate)
    contract(column, program.strain_coefficient, nine, inverse, program.strain)
    for i in range(6):
        slope[COLUMNS * i + VOID] = column[i]
