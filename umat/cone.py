"""Return of the stress to a circular cone in the space of principal stresses.

The yield function is f = q − M p − k, k = k0 + H κ, the plastic potential q − β p; κ is
the equivalent plastic shear strain √(2/3)‖e^p‖.  The direction n = s/‖s‖ of the deviator
is that of the elastic trial stress, so the return is one of the pair (p, q),

    p = p_tr + K β Δκ,   q = q_tr − 3 G Δκ,   Δκ = f_tr / (3 G + M K β + H),

or, if that overshoots q = 0, to the apex q = 0, p = −k/M with Δκ = q_tr/3G, which joins
it continuously.  With H < 0 the strength k falls to a residual one, where H is zero.
With M = β = 0 the cone is von Mises' cylinder, which has no apex
(de Souza Neto, Perić & Owen 2008, boxes 7.3, 8.8 to 8.10, compression positive).
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from umat.plastic import Batch
from umat.status import BAD_INPUT, OK


class Cone(NamedTuple):
    """Elastic moduli and cone of a material."""

    bulk: float
    """Bulk modulus (K) [stress]."""
    shear: float
    """Shear modulus (G) [stress]."""
    friction: float
    """Slope of the yield surface in the p–q plane (M) [-]."""
    dilation: float
    """Slope of the plastic potential (β) [-]; positive dilates."""
    strength: float
    """q of the yield surface at p = 0 without plastic strain (k0) [stress]."""
    hardening: float
    """Increase of that strength with plastic strain (H) [stress]; negative softens."""
    residual: float = 0.0
    """Strength at which softening ends [stress]."""


@njit(cache=True, nogil=True)
def return_slice(start: int, stop: int, cone: Cone, batch: Batch) -> None:
    """Fill points start … stop of the batch."""
    normal = np.empty(6)
    for point in range(start, stop):
        kappa = batch.old_plastic_strain[point]
        p_trial, q_trial = split_trial(
            cone.bulk,
            cone.shear,
            batch.strain_increment[point],
            batch.old_stress[point],
            normal,
        )
        p, q, slip, p_p, p_q, q_p, q_q = return_pair(cone, p_trial, q_trial, kappa)
        if np.isfinite(p + q + slip):
            batch.status[point] = OK
            batch.plastic_strain[point] = kappa + slip
            join(p, q, normal, batch.stress[point])
        else:
            batch.status[point] = BAD_INPUT
            batch.plastic_strain[point] = kappa
            batch.stress[point] = batch.old_stress[point]
            q, q_trial, p_p, p_q, q_p, q_q = 1.0, 1.0, 1.0, 0.0, 0.0, 1.0
            normal[:] = 0.0
        shrink = q / q_trial if q_trial > 0.0 else 1.0
        fill_tangent(cone, shrink, p_p, p_q, q_p, q_q, normal, batch.tangent[point])


@njit(cache=True, nogil=True)
def split_trial(bulk, shear, strain_increment, old_stress, normal):
    """Return p and q of the elastic trial stress and fill the unit deviator n (6,)."""
    volume = strain_increment[0] + strain_increment[1] + strain_increment[2]
    p_old = (old_stress[0] + old_stress[1] + old_stress[2]) / 3.0
    square = 0.0
    for i in range(6):
        spherical = p_old + 2.0 * shear * volume / 3.0 if i < 3 else 0.0
        normal[i] = old_stress[i] + 2.0 * shear * strain_increment[i] - spherical
        square += normal[i] ** 2
    size = np.sqrt(square)
    if size > 0.0:
        normal /= size
    return p_old + bulk * volume, np.sqrt(1.5) * size


@njit(cache=True, nogil=True)
def return_pair(cone, p_trial, q_trial, kappa):
    """Return p, q, Δκ and ∂p/∂p_tr, ∂p/∂q_tr, ∂q/∂p_tr, ∂q/∂q_tr."""
    strength = cone.strength + cone.hardening * kappa
    hardening = cone.hardening
    if hardening < 0.0 and strength <= cone.residual:
        strength, hardening = cone.residual, 0.0
    excess = q_trial - cone.friction * p_trial - strength
    if excess <= 0.0:
        return p_trial, q_trial, 0.0, 1.0, 0.0, 0.0, 1.0
    stiff, push = 3.0 * cone.shear, cone.bulk * cone.dilation
    modulus = stiff + cone.friction * push + hardening
    slip = excess / modulus
    if hardening < 0.0 and strength + hardening * slip < cone.residual:
        slip = (excess + strength - cone.residual) / (modulus - hardening)
        strength, modulus, hardening = cone.residual, modulus - hardening, 0.0
    q = q_trial - stiff * slip
    if q < 0.0 and cone.friction > 0.0:
        slip = q_trial / stiff
        apex = -(strength + hardening * slip) / cone.friction
        return apex, 0.0, slip, 0.0, -hardening / cone.friction / stiff, 0.0, 0.0
    p = p_trial + push * slip
    p_p, p_q = 1.0 - cone.friction * push / modulus, push / modulus
    q_p, q_q = cone.friction * stiff / modulus, 1.0 - stiff / modulus
    return p, q, slip, p_p, p_q, q_p, q_q


@njit(cache=True, nogil=True)
def join(p, q, normal, stress):
    """Fill the stress (6,) p 1 + √(2/3) q n."""
    for i in range(6):
        stress[i] = np.sqrt(2.0 / 3.0) * q * normal[i] + (p if i < 3 else 0.0)


@njit(cache=True, nogil=True)
def fill_tangent(cone, shrink, p_p, p_q, q_p, q_q, normal, tangent):
    """Fill the derivative (6, 6) of p 1 + √(2/3) q n; `shrink` is q/q_tr."""
    radial = 2.0 * cone.shear * shrink
    spherical = cone.bulk * p_p - radial / 3.0
    for i in range(6):
        one_i = 1.0 if i < 3 else 0.0
        by_normal = (2.0 * cone.shear * q_q - radial) * normal[i]
        by_normal += np.sqrt(6.0) * cone.shear * p_q * one_i
        by_volume = np.sqrt(2.0 / 3.0) * cone.bulk * q_p * normal[i] + spherical * one_i
        for j in range(6):
            tangent[i, j] = by_normal * normal[j] + (by_volume if j < 3 else 0.0)
        tangent[i, i] += radial
