"""Zhao & Kruyt (2020), eq. 13: the law of the enhanced CH model.

Ḟ = h [F_c − (F:n) exp(m (M − η) + ψ)] ε̇_q^p,   n = ε̇_q^p / ‖ε̇_q^p‖,
F_c = F_c0 / g_s(θ_F) and M = M_c g_s(θ_σ), g_s(θ) = 2c / ((1+c) − (1−c) cos3θ)  [ZK 2, 7, 8].
The exponential multiplies F:n only; otherwise there would be no peak.
"""

from typing import NamedTuple

import numpy as np

from ..lanes import inlined, kernel, put, row, six, store
from .law import SMALL, TINY, cos3theta, determinant, deviator, dot, law, plus, scaled, stress_ratio

SQRT6 = 6.0**0.5
SQRT2 = 2.0**0.5


class ZhaoKruyt(NamedTuple):
    """Parameters of the law [-]."""

    h: float = 10.0  #: rate of change per plastic deviatoric strain
    m: float = 0.4  #: weight of M − η
    critical_fabric: float = 0.48  #: (F_c0) ‖F‖ in the critical state in triaxial compression
    critical_ratio: float = 1.25  #: (M_c) q/p in the critical state in triaxial compression
    extension: float = 0.75  #: (c) M_e / M_c


@kernel
def _slope(law, inputs, slope):
    """Derivative of `increment`, written out: ΔF = h (F_c − a X) u with u the plastic deviator, a = F:u/‖u‖."""
    extension = law.extension
    fabric, stress, psi = six(inputs, 0), six(inputs, 6), row(inputs, 12)
    u = deviator(six(inputs, 25))
    g = np.sqrt(dot(u, u) + TINY)
    n = scaled(1.0 / g, u)
    along = dot(fabric, n)
    # F_c(θ_F) and its gradient
    f = deviator(fabric)
    f2 = dot(f, f) + SMALL * SMALL
    f3 = 1.0 / (f2 * np.sqrt(f2))
    fabric_lode = 3.0 * SQRT6 * determinant(f) * f3
    slant = -(1.0 - extension) / (2.0 * extension)
    critical = law.critical_fabric * ((1.0 + extension) / (2.0 * extension) + slant * fabric_lode)
    df = cofactor(f)
    kf = law.critical_fabric * slant * 3.0 * SQRT6 * f3
    kf2 = -law.critical_fabric * slant * 3.0 * fabric_lode / f2
    # M(θ_σ) − η and its gradient by s/p
    ratio, eta = stress_ratio(stress)
    r2 = dot(ratio, ratio) + SMALL * SMALL
    r3 = 1.0 / (r2 * np.sqrt(r2))
    lode = 3.0 * SQRT6 * determinant(ratio) * r3
    bottom = 1.0 / (1.0 + extension - (1.0 - extension) * lode)
    limit = law.critical_ratio * 2.0 * extension * bottom
    dm = limit * (1.0 - extension) * bottom
    dr = cofactor(ratio)
    x = np.exp(law.m * (limit - eta) + psi)
    k1, k2 = dm * 3.0 * SQRT6 * r3, -3.0 * dm * lode / r2 - 1.5 / eta
    i_p = 3.0 / (stress[0] + stress[1] + stress[2])
    trend = scaled(i_p, (
        k1 * dr[0] + k2 * ratio[0], k1 * dr[1] + k2 * ratio[1], k1 * dr[2] + k2 * ratio[2],
        k1 * dr[3] + k2 * ratio[3], k1 * dr[4] + k2 * ratio[4], k1 * dr[5] + k2 * ratio[5],
    ))  # fmt: skip
    # d(s/p) = dev(dσ)/p − (s/p) tr dσ/(3p); every factor here is deviatoric but ratio
    pull = dot(trend, ratio) / 3.0
    b = law.h * (critical - along * x)
    kx = -law.h * along * x
    by_fabric = plus(scaled(kf, df), plus(scaled(kf2, f), scaled(-x, n)))
    trend = (trend[0] - pull, trend[1] - pull, trend[2] - pull, trend[3], trend[4], trend[5])
    kb = scaled(-law.h * x, plus(f, scaled(-along, n)))
    parts = (scaled(law.h, by_fabric), scaled(kx * law.m, trend), kx, kb, b)
    _slope_row(slope, 0, u[0], n[0], parts)
    _slope_row(slope, 1, u[1], n[1], parts)
    _slope_row(slope, 2, u[2], n[2], parts)
    _slope_row(slope, 3, u[3], n[3], parts)
    _slope_row(slope, 4, u[4], n[4], parts)
    _slope_row(slope, 5, u[5], n[5], parts)


@inlined
def _slope_row(slope, i, u, n, parts):
    """Write the derivative of one component of ΔF, that of the plastic deviator being u."""
    by_fabric, by_stress, by_psi, along, straight = parts
    store(slope, 31 * i, scaled(u, by_fabric))
    store(slope, 31 * i + 6, scaled(u, by_stress))
    put(slope, 31 * i + 12, u * by_psi)
    store(slope, 31 * i + 25, scaled(n, along))
    for k in range(6):
        own = (2.0 / 3.0 if i == k else -1.0 / 3.0) if i < 3 and k < 3 else (1.0 if i == k else 0.0)
        put(slope, 31 * i + 25 + k, row(slope, 31 * i + 25 + k) + own * straight)


@inlined
def cofactor(a):
    """Return the deviator of the gradient of det a, Mandel components, a a deviator."""
    return deviator((
        a[1] * a[2] - 0.5 * a[3] * a[3],
        a[0] * a[2] - 0.5 * a[4] * a[4],
        a[0] * a[1] - 0.5 * a[5] * a[5],
        a[4] * a[5] / SQRT2 - a[0] * a[3],
        a[3] * a[5] / SQRT2 - a[1] * a[4],
        a[3] * a[4] / SQRT2 - a[2] * a[5],
    ))  # fmt: skip


@law(ZhaoKruyt, "fabric", "stress", "state_parameter", "plastic", slope=_slope)
def increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
    """Return ΔF [ZK 13]."""
    u = deviator(plastic)
    along = dot(fabric, u) / np.sqrt(dot(u, u) + TINY)
    c = law.extension
    critical = law.critical_fabric * ((1.0 + c) - (1.0 - c) * cos3theta(deviator(fabric))) / (2.0 * c)
    eta_tensor, eta = stress_ratio(stress)
    limit = law.critical_ratio * 2.0 * c / ((1.0 + c) - (1.0 - c) * cos3theta(eta_tensor))
    return scaled(law.h * (critical - along * np.exp(law.m * (limit - eta) + state_parameter)), u)
