"""Zhao et al. (2022): how the fabric of a two-dimensional packing answers a strain probe [P 15].

The tensor is not the anisotropy F of the other laws but the whole of F_ij = (2/N_p) Σ n_i n_j [P 4]: its trace is the
coordination number Z, and A = F_1 − F_2. It lives in the plane x, y; the other components of a six-vector stay as they
are. The drive is the total strain, and the rate is linear in it:

    Ḟ = [d1 tr ε̇ + d2 ε̇_dev:τ̂] Î + [d3 tr ε̇ + d4 ε̇_dev:τ̂] τ̂ + d_ρ ε̇^ρ,

Î = I/√2, τ̂ the unit deviator of stress, ε̇^ρ what is left of ε̇ beside I and τ̂ (its part out of the plane of I and τ̂).
A second law for comparison is that of normals that follow the strain, Ḟ = 2 sym(F·ε̇) [P 19], as printed: it does not
keep Z.

Reductions [P §5.3]: d4 = −√2 d3 leaves four parameters; d2 = −√2 d1 besides leaves three, which makes the ellipse of
the answers to all probes a line [P 16]. The text of [P] names d1, d2, d_ρ as the three; its equation has d1, d3, d_ρ,
and so has this. `three_parameters` keeps d1 and d3; `refitted` finds those that come closest over all probes.

Two departures of the paper from itself, measured in `docs/fabric_laws.md`: the sign of Ȧ in [P 14] is opposite to what
[P 13] gives with A = F_1 − F_2 and y the major axis, and b_A/a_A = .004 of its text is .044 in its Table 2.

These laws stay outside the stress point: its fabric has no coordination number, and [P] leaves three dimensions open.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..mandel import Array

ROOT2 = 2.0**0.5
PLANE = np.array([0, 1, 5])  #: the components xx, yy, √2 xy among six
IDENTITY = np.array([1.0, 1.0, 0.0])


class Probe2D(NamedTuple):
    """Parameters of the law [-]; the defaults are those of q/p = 0.40 [P Table 2]."""

    d1: float = 47.20  #: of tr ε̇ on Z, over √2
    d2: float = -22.31  #: of ε̇_dev:τ̂ on Z, over √2
    d3: float = -15.43  #: of tr ε̇ on A, over √2
    d4: float = 15.67  #: of ε̇_dev:τ̂ on A, over √2
    d_rho: float = 32.20  #: (d_ρ) of the strain across I and τ̂


class Probe2DByAnisotropy(NamedTuple):
    """The law with the parameters of [P Table 2] read at the A of the moment [P Fig 7], linear between the samples.

    An extension: [P] says that its four samples are too few for a law of a whole path. Beyond them the ends are held.
    """


class UniformStrain2D(NamedTuple):
    """Ḟ = 2 w sym(F·ε̇) [P 19]."""

    share: float = 1.0  #: (w) part of the strain that the normals follow


class Sample(NamedTuple):
    """A packing that was probed [P Table 1], and its law [P Table 2]."""

    stress_ratio: float  #: q/p [-]
    coordination: float  #: (Z) [-]
    anisotropy: float  #: (A) [-]
    void_ratio: float  #: (e) in two dimensions [-]
    law: Probe2D


SAMPLES = (
    Sample(0.15, 4.302, 0.049, 0.1974, Probe2D(51.55, -46.98, -20.05, 25.95, 24.29)),
    Sample(0.30, 4.159, 0.135, 0.1976, Probe2D(52.45, -34.97, -20.18, 18.30, 24.94)),
    Sample(0.40, 3.997, 0.233, 0.1982, Probe2D(47.20, -22.31, -15.43, 15.67, 32.20)),
    Sample(0.44, 3.846, 0.320, 0.1984, Probe2D(42.42, -9.80, -13.12, 9.75, 28.51)),
)
"""The four samples of [P], by rising stress ratio."""


def sample(stress_ratio: float) -> Sample:
    """Return the sample of a stress ratio q/p; ValueError names those there are."""
    for one in SAMPLES:
        if abs(one.stress_ratio - stress_ratio) < 1e-9:
            return one
    known = ", ".join(f"{one.stress_ratio:.2f}" for one in SAMPLES)
    raise ValueError(f"no sample was probed at q/p = {stress_ratio:g}; there are {known}")


def four_parameters(law: Probe2D) -> Probe2D:
    """Return the law with d4 = −√2 d3 [P §5.3]."""
    return law._replace(d4=-ROOT2 * law.d3)


def three_parameters(law: Probe2D) -> Probe2D:
    """Return the law with d2 = −√2 d1 and d4 = −√2 d3 [P 16]."""
    return law._replace(d2=-ROOT2 * law.d1, d4=-ROOT2 * law.d3)


def four_refitted(law: Probe2D) -> Probe2D:
    """Return the law of four parameters that is closest over all probes, in the mean of squares."""
    return four_parameters(law._replace(d3=(law.d3 - law.d4 / ROOT2) / 2.0))


def three_refitted(law: Probe2D) -> Probe2D:
    """Return the law of three parameters that is closest over all probes, in the mean of squares."""
    return three_parameters(law._replace(d1=(law.d1 - law.d2 / ROOT2) / 2.0, d3=(law.d3 - law.d4 / ROOT2) / 2.0))


REDUCTIONS: dict[str, Callable[[Probe2D], Probe2D]] = {
    "four": four_parameters,
    "three": three_parameters,
    "four_refitted": four_refitted,
    "three_refitted": three_refitted,
}
"""The reduced forms by name."""


def unit_deviator(stress: ArrayLike) -> Array:
    """Return τ̂ (n, 3) of stresses (n, 6), in the plane; zero where there is none."""
    plane = np.asarray(stress, float)[:, PLANE]
    deviator = plane - 0.5 * (plane @ IDENTITY)[:, None] * IDENTITY
    size = np.linalg.norm(deviator, axis=1)[:, None]
    flat = size > 1e-12 * np.linalg.norm(plane, axis=1)[:, None]
    return np.divide(deviator, size, out=np.zeros_like(deviator), where=flat)


def probe_increment(parameters: Array, stress: Array, strain: Array) -> Array:
    """Return ΔF (n, 6) [P 15] of parameters (n, 5), stresses and strain increments (n, 6)."""
    d1, d2, d3, d4, d_rho = parameters.T
    tau, e = unit_deviator(stress), strain[:, PLANE]
    volume, shear = e @ IDENTITY, np.einsum("ni,ni->n", e, tau)
    across = e - 0.5 * volume[:, None] * IDENTITY - shear[:, None] * tau
    change = (d1 * volume + d2 * shear)[:, None] * IDENTITY / ROOT2
    change += (d3 * volume + d4 * shear)[:, None] * tau + d_rho[:, None] * across
    return _placed(change)


def parameters_at(anisotropy: ArrayLike) -> Array:
    """Return d1, d2, d3, d4, d_ρ (n, 5) at anisotropies A (n,), between the samples [P Fig 7]."""
    at, known = np.asarray(anisotropy, float), np.array([one.anisotropy for one in SAMPLES])
    table = np.array([one.law for one in SAMPLES])
    return np.stack([np.interp(at, known, column) for column in table.T], axis=1)


def anisotropy(fabric: ArrayLike) -> Array:
    """Return A = F_1 − F_2 (n,) of fabrics (n, 6) in the plane [P 5]."""
    f = np.asarray(fabric, float)
    return np.hypot(f[..., 0] - f[..., 1], ROOT2 * f[..., 5])


def uniform_increment(share: float, fabric: Array, strain: Array) -> Array:
    """Return ΔF (n, 6) = 2 w sym(F·ε) in the plane [P 19]."""
    f, e = fabric[:, PLANE].T, strain[:, PLANE].T
    cross = f[2] * e[2]
    both = (f[0] + f[1]) * e[2] + (e[0] + e[1]) * f[2]
    return _placed(share * np.stack([2.0 * f[0] * e[0] + cross, 2.0 * f[1] * e[1] + cross, both], axis=1))


def _placed(plane: Array) -> Array:
    out = np.zeros((len(plane), 6))
    out[:, PLANE] = plane
    return out


PLANAR_LAWS: dict[str, type[Any]] = {
    "probe_2d": Probe2D,
    "probe_2d_by_anisotropy": Probe2DByAnisotropy,
    "uniform_strain_2d": UniformStrain2D,
}
"""Records of the laws in the plane by the name that a case uses."""
