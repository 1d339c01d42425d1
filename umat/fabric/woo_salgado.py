"""Woo & Salgado (2015): Ḟ = λ̇ c1 (1 + c2 cos3θ_σ) (n − F) [ZK Table 1 (iv)].

As `li_dafalias` (loading index and unit of F are read as there), at a pace that depends on the Lode angle of stress,
θ = 0 in triaxial compression, 60° in extension [ZK §2.2]. Critical state: F = F_c0 n.
|c2| must be below 1, or the fabric would move away from n somewhere. Where ‖s/p‖ < 10⁻³ the Lode angle fades out.
"""

from typing import NamedTuple

from .law import cos3theta, deviator, law, length, plus, scaled, stress_ratio


class WooSalgado(NamedTuple):
    """Parameters of the law [-]."""

    rate: float = 10.0  #: (c1) per plastic deviatoric strain; none is given, this is h of [ZK Table 4]
    lode: float = 0.0  #: (c2) weight of cos3θ, |c2| < 1; none is given: no influence
    critical_fabric: float = 0.48  #: (F_c0) unit in which the law measures F [ZK Table 4]


@law(WooSalgado, "fabric", "stress", "plastic")
def increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
    """Return ΔF [ZK Table 1]."""
    u = deviator(plastic)
    direction, _ = stress_ratio(stress)
    pace = law.rate * (1.0 + law.lode * cos3theta(direction))
    toward = scaled(law.critical_fabric, u)
    return scaled(pace, plus(toward, scaled(-length(u), fabric)))
