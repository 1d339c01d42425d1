"""Measures of stress, strain and fabric that the anisotropic critical state theory (ACST) speaks of.

Functions of Mandel vectors (..., 6), compression positive; the anisotropy tensor F is symmetric and traceless. [K n] is
an equation of Khayyer et al. (2024), [G n] of Yang et al. (2013), [Y] Yuan et al. (2019). Where a measure is not
defined (the direction of a vanishing deviator, a ratio to p = 0), it is zero or NaN, never an exception.

[K] normalises the fabric tensor so that A = 1 in the critical state. The F of the CH model has ‖F‖ = F_c0 there, so
`dilatancy_state` takes A over its critical value A_c.
"""

import numpy as np
from numpy.typing import ArrayLike

from .directions import AXES, Axis
from .mandel import Array, cos3theta, deviator, dot, from_tensor, norm, principal, to_tensor

HORIZONTAL = 1e-4
"""Angle from −90° within which an axis counts as horizontal [deg]."""


ROUNDING = 1e-14
"""Length of a deviator over that of its tensor below which it is rounding."""


def ratio(above: ArrayLike, below: ArrayLike) -> Array:
    """Return above / below, NaN where below is 0."""
    above, below = np.broadcast_arrays(np.asarray(above, float), np.asarray(below, float))
    return np.divide(above, below, out=np.full(below.shape, np.nan), where=below != 0.0)


def direction(tensor: ArrayLike) -> Array:
    """Return the (..., 6) unit deviator s/‖s‖ of a tensor; zero where there is none but rounding."""
    s = deviator(tensor)
    length = norm(s)[..., None]
    return np.where(length > ROUNDING * norm(tensor)[..., None], np.nan_to_num(ratio(s, length)), 0.0)


def deviatoric_strain(strain: ArrayLike) -> Array:
    """Return the (...) deviatoric strain ε_q = √(2/3 e:e) [-]."""
    return np.sqrt(2.0 / 3.0) * norm(deviator(strain))


def intermediate(tensor: ArrayLike) -> Array:
    """Return the (...) intermediate ratio b = (t2 − t3)/(t1 − t3) of principal values; F_b for a fabric [Y]."""
    first, second, third = np.moveaxis(principal(tensor), -1, 0)
    return ratio(second - third, first - third)


def inclination(tensor: ArrayLike, vertical: Axis = "z", horizontal: Axis = "x") -> Array:
    """Return the (...) angle α of the major principal axis in a plane from the vertical [deg], −90 < α ≤ 90.

    An axis within `HORIZONTAL` of −90° is at 90°, so that rounding does not turn it back and forth.
    """
    full, v, h = to_tensor(tensor), AXES.index(vertical), AXES.index(horizontal)
    across, along = 2.0 * full[..., v, h], full[..., v, v] - full[..., h, h]
    angle = 0.5 * np.degrees(np.arctan2(across, along))
    return np.where(np.hypot(across, along) > 0.0, np.where(angle < HORIZONTAL - 90.0, 90.0, angle), np.nan)


def anisotropy(fabric: ArrayLike, loading: ArrayLike) -> Array:
    """Return the (...) fabric anisotropy variable A = F:n, n the unit deviator of `loading` [K 5]."""
    return dot(fabric, direction(loading))


def relative_orientation(fabric: ArrayLike, loading: ArrayLike) -> Array:
    """Return the (...) A' = n_F:n of the unit deviators of fabric and loading, between −1 and 1 [K 18]."""
    return dot(direction(fabric), direction(loading))


def joint_invariant(stress: ArrayLike, fabric: ArrayLike) -> Array:
    """Return the (...) joint invariant K_F = s:F, in the unit of stress [K 16]."""
    return dot(deviator(stress), fabric)


def von_mises_fabric(fabric: ArrayLike) -> Array:
    """Return the (...) F_vM = √(3/2 F:F) [K 14], which [Y] calls F_q."""
    return np.sqrt(1.5) * norm(fabric)


def joint_invariants(stress: ArrayLike, fabric: ArrayLike) -> tuple[Array, Array, Array, Array]:
    """Return L1 = σ:F, L2 = σ:F², L3 = σ²:F and L4 = σ²:F² [G 11]."""
    s, f = to_tensor(stress), to_tensor(fabric)
    return (
        np.einsum("...ij,...ij->...", s, f),
        np.einsum("...ij,...ij->...", s, f @ f),
        np.einsum("...ij,...ij->...", s @ s, f),
        np.einsum("...ij,...ij->...", s @ s, f @ f),
    )


def dilatancy_state(
    void_ratio: ArrayLike,
    critical: ArrayLike,
    anisotropy: ArrayLike,
    e_lim: float,
    e_a: float,
    critical_anisotropy: float,
) -> Array:
    """Return the (...) dilatancy state parameter ζ = ψ − e_A ⟨e_lim − e⟩/(e_lim − e_c) (A/A_c − 1) [K 20].

    Parameters
    ----------
    void_ratio, critical : (...) array
        Void ratio (e) and that of the critical state at the same pressure (e_c) [-]; ψ = e − e_c.
    anisotropy : (...) array
        Fabric anisotropy variable (A) [-].
    e_lim : float
        Critical void ratio at p = 0 [-].
    e_a : float
        Weight of the fabric (e_A) [-].
    critical_anisotropy : float
        A in the critical state (A_c) [-].
    """
    void_ratio, critical = np.asarray(void_ratio, float), np.asarray(critical, float)
    weight = ratio(np.maximum(e_lim - void_ratio, 0.0), e_lim - critical)
    return void_ratio - critical - e_a * weight * (np.asarray(anisotropy, float) / critical_anisotropy - 1.0)


def initial_fabric(poisson_ratio: float, slope: float) -> float:
    """Return F_0(ν) = 3√6 (2ν − 1)/(3 (1 − 2ν) + (dq/dp)(ν − 2)) of a cross-anisotropic elastic sample [K 22].

    slope: dq/dp at the start of a test at constant volume. F = √(2/3) F_0 diag(1, −½, −½), axis of symmetry first
    [K 21].
    """
    return (
        3.0
        * 6.0**0.5
        * (2.0 * poisson_ratio - 1.0)
        / (3.0 * (1.0 - 2.0 * poisson_ratio) + slope * (poisson_ratio - 2.0))
    )


def shape(cos3: ArrayLike, extension: float) -> Array:
    """Return g(θ) [K 24] of cos 3θ: 1 in compression (cos 3θ = 1), c = M_e/M_c in extension (−1).

    g = (√((1 + c²)² + 4c (1 − c²) y) − (1 + c²)) / (2 (1 − c) y) with y = sin 3θ of [K 25], which is −cos 3θ here. At
    y = 0 it is the limit c (1 + c)/(1 + c²).
    """
    c, x = extension, np.asarray(cos3, float)
    root = np.sqrt((1.0 + c * c) ** 2 - 4.0 * c * (1.0 - c * c) * x)
    return 2.0 * c * (1.0 + c) / (root + 1.0 + c * c)  # the quotient with its root moved below, regular at x = 0


def loading_direction(stress: ArrayLike, extension: float) -> Array:
    """Return the (..., 6) unit loading direction n of [K 23], the gradient of R/g(θ) by the stress ratio, deviatoric.

    R = q/p and θ are those of r = s/p [K 25, 26]; it differs from s/‖s‖ between compression and extension.
    """
    s = direction(stress)  # the gradient does not depend on the size of r
    x = cos3theta(s)[..., None]
    c = extension
    root = np.sqrt((1.0 + c * c) ** 2 - 4.0 * c * (1.0 - c * c) * x)
    slope = shape(x, c) * 2.0 * c * (1.0 - c * c) / (root * (root + 1.0 + c * c))  # dg/dx
    full = to_tensor(s)
    turn = 3.0 * 6.0**0.5 * deviator(from_tensor(full @ full)) - 3.0 * x * s  # d cos 3θ / d r, times ‖r‖
    return direction(s - slope / shape(x, c) * turn)


def second_order_work(stress: ArrayLike, strain: ArrayLike) -> Array:
    """Return Δσ:Δε of each row of a history (m, 6) since the row before it, the first 0; in the unit of stress."""
    return dot(
        np.diff(stress, axis=0, prepend=np.asarray(stress)[:1]), np.diff(strain, axis=0, prepend=np.asarray(strain)[:1])
    )
