"""The state of a first call, compiled: what `umat.initial_state` does for one point, without allocating.

`deposit` is F = ‖F‖/√6 (3 d⊗d − I), large along the deposition axis d [ZK 6]; `sliding` the sliding that the forces
need in equilibrium, the total form [ZK Table 3]. A stress below the open pressure is that of an opened packing which
is about to close, p (I + 2F/5), under which no contact has a tangential force.
"""

import math

from umat.export.layout import AZIMUTH, BEDDING_ANGLE, NORM, VERTICAL
from umat.lanes import kernel
from umat.mandel import COLUMN, FACTOR, ROW

OUTSIDE = 1
"""Some contact would pull or slide freely."""


@kernel
def property_of(props, count, place):
    """Return a number of PROPS, 0 where there are not so many."""
    return props[place] if place < count else 0.0


@kernel
def deposit(props, count, components, fabric):
    """Fill the (6,) Mandel fabric of a deposit whose bedding dips by an angle towards an azimuth."""
    norm = property_of(props, count, NORM)
    tilt = math.radians(property_of(props, count, BEDDING_ANGLE))
    azimuth = math.radians(property_of(props, count, AZIMUTH))
    vertical = int(property_of(props, count, VERTICAL)) - 1
    if vertical < 0:
        vertical = 1 if components == 4 else 2
    first = 1 if vertical == 0 else 0
    second = 3 - vertical - first
    for k in range(6):
        along = 1.0
        for axis in (ROW[k], COLUMN[k]):
            if axis == vertical:
                along *= math.cos(tilt)
            elif axis == first:
                along *= math.sin(tilt) * math.cos(azimuth)
            elif axis == second:
                along *= math.sin(tilt) * math.sin(azimuth)
        fabric[k] = norm / math.sqrt(6.0) * (3.0 * along - (1.0 if k < 3 else 0.0)) * FACTOR[k]


@kernel
def settle_open(constants, stress, fabric):
    """Give a (6,) stress over p_ref that is below the open pressure the one of a packing about to close."""
    p = (stress[0] + stress[1] + stress[2]) / 3.0
    if -constants.open_pressure <= p <= constants.open_pressure:
        for k in range(6):
            stress[k] = constants.open_pressure * ((1.0 if k < 3 else 0.0) + 0.4 * fabric[k])


@kernel
def sliding(constants, rule, stress, fabric, void_ratio, slip, force):
    """Fill the (N,) sliding done and, in the rate form, the (N, 3) forces of a (6,) stress over p_ref; 0 if possible.

    f = σ G⁻¹ n / c(e); λ = f_n^½ R R_p / ((R_p − R) 2 k_pR) compliance with R_p = (e_c/e) tan φ_μ.
    """
    g, s = inverse(fabric), square(stress, 1.0)
    compliance, _, ease_p = constants.elastic
    e_ref, slope, exponent = constants.line
    density = 3.0 / (2.0 * math.pi) * (13.28 - 8.0 * void_ratio) / (1.0 + void_ratio)
    p = max((stress[0] + stress[1] + stress[2]) / 3.0, 0.0)
    limit = (e_ref - slope * p**exponent) / void_ratio * constants.tan_mu
    for a in range(slip.shape[0]):
        n = (rule.normals[a, 0], rule.normals[a, 1], rule.normals[a, 2])
        z = times(s, times(g, n))
        f = (z[0] / density, z[1] / density, z[2] / density)
        normal = f[0] * n[0] + f[1] * n[1] + f[2] * n[2]
        t = (f[0] - normal * n[0], f[1] - normal * n[1], f[2] - normal * n[2])
        ratio = math.sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]) / normal
        if not (normal > 0.0 and ratio < limit):
            return OUTSIDE
        slip[a] = ease_p * compliance * math.sqrt(normal) * limit * ratio / (limit - ratio)
        if a < force.shape[0]:
            force[a, 0], force[a, 1], force[a, 2] = f
    return 0


@kernel
def square(vector, share):
    """Return the six different entries, xx, yy, zz, yz, xz, xy, of `share` times a Mandel vector's tensor."""
    return (
        share * vector[0],
        share * vector[1],
        share * vector[2],
        share * vector[3] / FACTOR[3],
        share * vector[4] / FACTOR[4],
        share * vector[5] / FACTOR[5],
    )


@kernel
def times(tensor, n):
    """Return a symmetric tensor of six entries times a vector."""
    xx, yy, zz, yz, xz, xy = tensor
    return (
        xx * n[0] + xy * n[1] + xz * n[2],
        xy * n[0] + yy * n[1] + yz * n[2],
        xz * n[0] + yz * n[1] + zz * n[2],
    )


@kernel
def inverse(fabric):
    """Return the six entries of the inverse of G = I/3 + 2F/15."""
    xx, yy, zz, d, e, f = square(fabric, 2.0 / 15.0)
    a, b, c = 1.0 / 3.0 + xx, 1.0 / 3.0 + yy, 1.0 / 3.0 + zz
    ixx, iyy, izz = b * c - d * d, a * c - e * e, a * b - f * f
    iyz, ixz, ixy = e * f - a * d, d * f - b * e, d * e - c * f
    scale = 1.0 / (a * ixx + f * ixy + e * ixz)
    return ixx * scale, iyy * scale, izz * scale, iyz * scale, ixz * scale, ixy * scale
