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

from ..fabric.law import dot, plus, scaled
from ..lanes import inlined, kernel, nine, put, row, six, store
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
    ELASTIC,
    FABRIC,
    FABRIC_MIDDLE,
    FINAL,
    FIRST,
    FORCE,
    FORCE_OLD,
    FRICTION,
    H_SLIPPED,
    INVERSE,
    MARGIN,
    OLD,
    P_DILATANCY,
    P_FRICTION,
    PROJECTED,
    PSI,
    PSI_P,
    SCALED,
    TANGENTIAL,
    TRIPLES,
    VOID,
    C,
    H,
    Y,
)  # fmt: skip

SQRT2 = 2.0**0.5
HALF_SQRT2 = 0.5 * SQRT2
DENSITY = 3.0 / (2.0 * np.pi)  #: of c(e) = DENSITY (13.28 − 8 e) / (1 + e)
FLOOR = 0.02  #: least void ratio, and critical void ratio, for which the law is used
MAX_VOID_RATIO = 1.64  #: the contact density ∝ 13.28 − 8 e stays positive


@inlined
def plain(a):
    """Return the plain components of a tensor in Mandel components."""
    return (a[0], a[1], a[2], HALF_SQRT2 * a[3], HALF_SQRT2 * a[4], HALF_SQRT2 * a[5])


@inlined
def matrix(a):
    """Return the nine entries of a symmetric matrix of six plain components."""
    return (a[0], a[5], a[4], a[5], a[1], a[3], a[4], a[3], a[2])


@inlined
def inverse_fabric(fabric):
    """Return the inverse of G = I/3 + 2F/15 (plain components)."""
    xx, yy, zz, yz, xz, xy = fabric
    a, b, c = 1.0 / 3.0 + 2.0 / 15.0 * xx, 1.0 / 3.0 + 2.0 / 15.0 * yy, 1.0 / 3.0 + 2.0 / 15.0 * zz
    d, e, f = 2.0 / 15.0 * yz, 2.0 / 15.0 * xz, 2.0 / 15.0 * xy
    ixx, iyy, izz = b * c - d * d, a * c - e * e, a * b - f * f
    iyz, ixz, ixy = e * f - a * d, d * f - b * e, d * e - c * f
    return scaled(1.0 / np.maximum(a * ixx + f * ixy + e * ixz, 1e-30), (ixx, iyy, izz, iyz, ixz, ixy))


@inlined
def contact_density(void_ratio):
    """Return c(e) = 2 m_V r³ and its derivative [ZK Table 3]."""
    denominator = 1.0 / (1.0 + void_ratio)
    c = DENSITY * (13.28 - 8.0 * void_ratio) * denominator
    return c, -DENSITY * 8.0 * denominator - c * denominator


@inlined
def critical_void_ratio(p, line):
    """Return e_c and its derivative by p (p over p_ref) [ZK Table 3]; line = (e_ref, λ_c, ξ)."""
    e_ref, slope, exponent = line
    power = slope * np.maximum(p, 1e-12) ** exponent
    return e_ref - power, -exponent * power / np.maximum(p, 1e-12)


@kernel
def geometry(rows, line, tan_mu, total):
    """Fill what the contact planes read and the geometry rows, from the trial state and the old one."""
    stress, fabric = plain(six(rows, Y)), plain(six(rows, Y + FABRIC))
    middle = scaled(0.5, plus(fabric, plain(six(rows, OLD + FABRIC))))
    inverse = inverse_fabric(middle)
    store(rows, FABRIC_MIDDLE, middle)
    store(rows, INVERSE, inverse)
    # the stress (or its increment), the fabric and the density that make the forces
    if total:
        half, source = 1.0, inverse_fabric(fabric)
        density, d_density = contact_density(row(rows, Y + VOID))
    else:
        half, source = 0.5, inverse
        density, d_density = contact_density(0.5 * (row(rows, Y + VOID) + row(rows, OLD + VOID)))
        stress = plus(stress, scaled(-1.0, plain(six(rows, OLD))))
    scale = 1.0 / density
    source = scaled(scale, source)
    z = times(matrix(stress), matrix(source))
    store(rows, SCALED, source)
    store(rows, BY_FABRIC, mixed(z, half * density, z, 0.0))
    put(rows, BY_VOID, -half * d_density * scale)
    if not total:
        z = mixed(z, 1.0, nine(rows, FORCE_OLD), 1.0)
    store(rows, FORCE, z)
    friction(rows, line, tan_mu)


@kernel
def friction(rows, line, tan_mu):
    """Fill tanφ_p (end), tanφ_d and ψ (middle) and their derivatives; start the margin with the law's own range."""
    p = (row(rows, Y) + row(rows, Y + 1) + row(rows, Y + 2)) / 3.0
    p_old = (row(rows, OLD) + row(rows, OLD + 1) + row(rows, OLD + 2)) / 3.0
    void, void_old = row(rows, Y + 12), row(rows, OLD + 12)
    critical, slope = critical_void_ratio(p, line)
    critical_old, _ = critical_void_ratio(p_old, line)
    put(rows, MARGIN, np.minimum(np.minimum(critical - FLOOR, p), MAX_VOID_RATIO - void))
    critical, critical_old = np.maximum(critical, FLOOR), np.maximum(critical_old, FLOOR)
    i_void, i_critical = 1.0 / void, 1.0 / critical
    tan_p = critical * i_void * tan_mu
    tan_d = void * i_critical * tan_mu
    put(rows, FRICTION, tan_p)
    put(rows, DILATANCY, 0.5 * (tan_d + void_old / critical_old * tan_mu))
    put(rows, P_FRICTION, tan_p * i_critical * slope)
    put(rows, P_DILATANCY, -0.5 * tan_d * i_critical * slope)
    put(rows, E_FRICTION, -tan_p * i_void)
    put(rows, E_DILATANCY, 0.5 * tan_d * i_void)
    middle, slope = critical_void_ratio(0.5 * (p + p_old), line)
    put(rows, PSI, 0.5 * (void + void_old) - middle)
    put(rows, PSI_P, slope)


@inlined
def symmetric(rows, first):
    """Return six plain rows as the nine entries of a symmetric matrix."""
    return matrix(six(rows, first))


@inlined
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


@inlined
def mandel(a):
    """Return the Mandel components of the symmetric part of a matrix; also of its gradient by a symmetric tensor."""
    return (
        a[0], a[4], a[8],
        HALF_SQRT2 * (a[5] + a[7]), HALF_SQRT2 * (a[2] + a[6]), HALF_SQRT2 * (a[1] + a[3]),
    )  # fmt: skip


@kernel
def add_elastic(rows):
    """Fill H = H of the sliding + Σ W C_t δ_ik n_j n_l + Σ W E_i n_k n_j n_l, see `contact`."""
    for i in range(3):
        for k in range(3):
            for pair in range(6):
                here = 6 * (3 * i + k) + pair
                whole = row(rows, H_SLIPPED + here) + row(rows, ELASTIC + 10 * i + TRIPLES[k, pair])
                if i == k:
                    whole = whole + row(rows, TANGENTIAL + pair)
                put(rows, H + here, whole)


@kernel
def transform(rows, stiffness):
    """Fill C_{ik,mn} = G_jm⁻¹ H_{ik,jl} SCALED_ln from the rows of H."""
    inverse, source = symmetric(rows, INVERSE), symmetric(rows, SCALED)
    for ik in range(9):
        store(rows, C + 9 * ik, times(times(inverse, symmetric(rows, stiffness + 6 * ik)), source))


@kernel
def project(rows, displacement, strain):
    """Fill the strain sym(D G_m⁻¹), Mandel, and the matrix itself."""
    product = times(nine(rows, displacement), symmetric(rows, INVERSE))
    store(rows, PROJECTED, product)
    store(rows, strain, mandel(product))


@kernel
def friction_columns(rows):
    """Fill the derivatives of the strain by p and by e through the friction angles, and the first-order part."""
    a, b = nine(rows, D_FRICTION), symmetric(rows, D_DILATANCY)
    g = symmetric(rows, INVERSE)
    store(rows, COLUMN_P, mandel(times(mixed(a, row(rows, P_FRICTION), b, row(rows, P_DILATANCY)), g)))
    store(rows, COLUMN_E, mandel(times(mixed(a, row(rows, E_FRICTION), b, row(rows, E_DILATANCY)), g)))
    store(rows, FIRST, mandel(times(nine(rows, D_LATE), g)))


@inlined
def mixed(a, x, b, y):
    """Return x a + y b of nine entries."""
    return (
        x * a[0] + y * b[0], x * a[1] + y * b[1], x * a[2] + y * b[2],
        x * a[3] + y * b[3], x * a[4] + y * b[4], x * a[5] + y * b[5],
        x * a[6] + y * b[6], x * a[7] + y * b[7], x * a[8] + y * b[8],
    )  # fmt: skip


@kernel
def by_force(rows, slope, i, j, place, share, total, evolving):
    """Fill one row of a slope: strain ij through the forces, by stress, by fabric (if it evolves) and by void ratio.

    share (C_{ik,jm} + C_{jk,im}) is the derivative by σ_km; the void ratio scales the forces as the stress does.
    """
    at_i, at_j = C + 27 * i + 3 * j, C + 27 * j + 3 * i
    k = (
        row(rows, at_i) + row(rows, at_j),
        row(rows, at_i + 1) + row(rows, at_j + 1),
        row(rows, at_i + 2) + row(rows, at_j + 2),
        row(rows, at_i + 9) + row(rows, at_j + 9),
        row(rows, at_i + 10) + row(rows, at_j + 10),
        row(rows, at_i + 11) + row(rows, at_j + 11),
        row(rows, at_i + 18) + row(rows, at_j + 18),
        row(rows, at_i + 19) + row(rows, at_j + 19),
        row(rows, at_i + 20) + row(rows, at_j + 20),
    )
    s = scaled(share, mandel(k))
    scale = dot(s, six(rows, Y))
    if not total:
        scale = scale - dot(s, six(rows, OLD))
    p = row(rows, COLUMN_P + place) / 3.0
    store(rows, slope, (s[0] + p, s[1] + p, s[2] + p, s[3], s[4], s[5]))
    put(rows, slope + VOID, scale * row(rows, BY_VOID) + row(rows, COLUMN_E + place))
    if evolving:
        f = mandel(times(transposed(nine(rows, BY_FABRIC)), k))
        store(rows, slope + FABRIC, scaled(-2.0 / 15.0 * share, f))


@inlined
def transposed(a):
    """Return the transpose of nine entries."""
    return (a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8])


@kernel
def by_density(rows, slope, geo, third, i, j, share):
    """Add to one row of a slope, and keep, the derivative by F through the density of contacts and through G_m⁻¹."""
    j0, j1, j2 = pair_row(0, j), pair_row(1, j), pair_row(2, j)
    i0, i1, i2 = pair_row(0, i), pair_row(1, i), pair_row(2, i)
    gj = (row(rows, j0), row(rows, j1), row(rows, j2))
    gi = (row(rows, i0), row(rows, i1), row(rows, i2))
    ai, bi, ci = half_share(rows, third + 10 * i, gj)
    aj, bj, cj = half_share(rows, third + 10 * j, gi)
    di, dj = PROJECTED + 3 * i, PROJECTED + 3 * j
    pi = (row(rows, di), row(rows, di + 1), row(rows, di + 2))
    pj = (row(rows, dj), row(rows, dj + 1), row(rows, dj + 2))
    m = mandel(mixed(outer(pi, gj), 1.0, outer(pj, gi), 1.0))
    values = (
        share * (0.5 * (ai[0] + aj[0]) - m[0] / 15.0),
        share * (0.5 * (ai[1] + aj[1]) - m[1] / 15.0),
        share * (0.5 * (bi[0] + bj[0]) - m[2] / 15.0),
        share * (HALF_SQRT2 * (bi[1] + bj[1]) - m[3] / 15.0),
        share * (HALF_SQRT2 * (ci[0] + cj[0]) - m[4] / 15.0),
        share * (HALF_SQRT2 * (ci[1] + cj[1]) - m[5] / 15.0),
    )
    store(rows, geo, values)
    store(rows, slope + FABRIC, plus(six(rows, slope + FABRIC), scaled(row(rows, FINAL), values)))


@kernel
def pair_row(q, j):
    """Return the row of G_m⁻¹'s entry q j."""
    return INVERSE + (q if q == j else 6 - q - j)


@inlined
def outer(a, b):
    """Return the nine entries a_i b_j."""
    return (a[0] * b[0], a[0] * b[1], a[0] * b[2], a[1] * b[0], a[1] * b[1], a[1] * b[2],
            a[2] * b[0], a[2] * b[1], a[2] * b[2])  # fmt: skip


@inlined
def half_share(rows, t, g):
    """Return Σ_q T_{q,ab} g_q as ((xx, yy), (zz, yz), (xz, xy)); T in the order of `planes.TRIPLE`."""
    x, y, z = g
    # xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz
    t0, t1, t2, t3, t4 = row(rows, t), row(rows, t + 1), row(rows, t + 2), row(rows, t + 3), row(rows, t + 4)
    t5, t6, t7, t8, t9 = (
        row(rows, t + 5), row(rows, t + 6), row(rows, t + 7), row(rows, t + 8), row(rows, t + 9),
    )  # fmt: skip
    return (
        (t0 * x + t1 * y + t2 * z, t3 * x + t6 * y + t7 * z),
        (t5 * x + t8 * y + t9 * z, t4 * x + t7 * y + t8 * z),
        (t2 * x + t4 * y + t5 * z, t1 * x + t3 * y + t4 * z),
    )


@kernel
def strain_and_slope(rows, displacement, stiffness, third, strain, slope, geo, total, evolving, full):
    """Fill a strain (all of it, or its plastic part) and its derivative, from the rows of its D, H and T.

    full: whether T is there; its part of the slope goes to the lanes that are `FINAL`.
    """
    project(rows, displacement, strain)
    transform(rows, stiffness)
    for place in range(6):
        i = place if place < 3 else (1 if place == 3 else 0)
        j = place if place < 3 else (2 if place < 5 else 1)
        share = 0.5 if place < 3 else HALF_SQRT2
        by_force(rows, slope + COLUMNS * place, i, j, place, share, total, evolving)
        if full and evolving:
            by_density(rows, slope + COLUMNS * place, geo + 6 * place, third, i, j, share)
