"""Yuan et al. (2019), eq. 7: contacts are made by the stress ratio and migrate with plastic strain.

Ḟ = C1 h3(θ) (1 + C2 ‖η‖) η̇ + C3 ‖ε̇_q^p‖ (C_F(θ) η − F),   η = s/p,
C_F = M_F/M,   M_F = M_Fc h2(θ),   M = M_cc h1(θ),
h_i = (2 l_i⁴ / (1 + l_i⁴ + (1 − l_i⁴) sin3θ_l))^¼  [Y 3.1, 4, 6].

θ_l is the Lode angle of stress, −30° in triaxial compression, where h = 1, and +30° in extension, where h = l; so
sin3θ_l = −cos3θ of the other laws. M_F is a critical √(3/2) ‖F‖, M a critical q/p, ‖η‖ a tensor norm.
l1 = 3/(3 + M_cc) [Y 3.3], l2 = M_Ft/M_Fc, l3 = 1/l1. The older law [Y 2.1] is l2 = l1, l3 = 1 (`older`).

At rest wherever η is constant and F = C_F η, the critical state among them; F need not be coaxial with ε̇_q^p.
The rate form is used, at the middle of the step and with the increment of s/p over it; the implicit update [Y 8.3], the
same law at the end of the step, is for given histories. (There Λ̇ is the deviatoric strain rate, the plastic one here.)
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from .law import cos3theta, deviator, law, length, plus, scaled, stress_ratio


class Yuan(NamedTuple):
    """Parameters of the law [-], from [Y Table 2]; a shape l = 0 is found from the others."""

    creation: float = 0.1  #: (C1) change of F per change of s/p
    creation_growth: float = 6.0  #: (C2) its growth with ‖s/p‖
    migration: float = 7.6  #: (C3) pace per plastic deviatoric strain
    critical_ratio: float = 0.78  #: (M_cc) critical q/p in triaxial compression
    critical_fabric: float = 0.66  #: (M_Fc) critical √(3/2) ‖F‖ in triaxial compression
    extension_fabric: float = 0.77  #: (M_Ft) critical √(3/2) ‖F‖ in triaxial extension; not read if l2 is given
    ratio_shape: float = 0.0  #: (l1) M_ct / M_cc; 0: 3 / (3 + M_cc)
    fabric_shape: float = 0.0  #: (l2) 0: M_Ft / M_Fc
    creation_shape: float = 0.0  #: (l3) 0: 1 / l1


def older(law: Yuan) -> Yuan:
    """Return the law without the influence of the intermediate stress, l2 = l1 and l3 = 1 [Y 2.1]."""
    ratio_shape, _, _ = shapes(law)
    return law._replace(ratio_shape=ratio_shape, fabric_shape=ratio_shape, creation_shape=1.0)


@njit
def shapes(law):
    """Return l1, l2, l3."""
    l1 = law.ratio_shape if law.ratio_shape > 0.0 else 3.0 / (3.0 + law.critical_ratio)
    l2 = law.fabric_shape if law.fabric_shape > 0.0 else law.extension_fabric / law.critical_fabric
    l3 = law.creation_shape if law.creation_shape > 0.0 else 1.0 / l1
    return l1, l2, l3


@njit
def shape(extension, sin3lode):
    """Return h(θ_l) [Y 3.1]: 1 in triaxial compression, l in extension."""
    l4 = extension**4
    return np.sqrt(np.sqrt(2.0 * l4 / (1.0 + l4 + (1.0 - l4) * sin3lode)))


@law(Yuan, "fabric", "stress", "ratio", "plastic")
def increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
    """Return ΔF [Y 7]."""
    l1, l2, l3 = shapes(law)
    eta, _ = stress_ratio(stress)
    sin3lode = -cos3theta(eta)
    pull = law.critical_fabric * shape(l2, sin3lode) / (law.critical_ratio * shape(l1, sin3lode))
    made = law.creation * shape(l3, sin3lode) * (1.0 + law.creation_growth * length(eta))
    migrating = law.migration * length(deviator(plastic))
    return plus(scaled(made, ratio), scaled(migrating, plus(scaled(pull, eta), scaled(-1.0, fabric))))
