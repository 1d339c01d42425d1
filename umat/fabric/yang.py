"""Yang et al. (2018): Ḟ = Σ_i λ̇_i c_i [n − (1 + D_i) F], D_i dilatancy functions [ZK Table 1 (iv)].

Two plastic mechanisms, each with a loading index and a dilatancy of its own, cannot be told apart in a point without
yield surfaces. With one constant c1 = c2 they need not be: Σ λ̇_i is the plastic deviatoric and Σ λ̇_i D_i the plastic
volumetric strain, both known here. So D is what the contacts do, D = ε̇_v^p/ε̇_q^p with the scalar
ε̇_q^p = √(2/3) ‖ε̇_q^p‖, no function of its own, and

    Ḟ = c1 [F_c0 ε̇_q^p − (‖ε̇_q^p‖ + w √(3/2) ε̇_v^p) F],

F_c0 the unit of F as in `li_dafalias`. Where the sample dilates ‖F‖ heads for F_c0/(1 + D) > F_c0, so F has a
peak; in the critical state D = 0 and F = F_c0 n.
"""

from typing import NamedTuple

from .law import deviator, law, length, plus, scaled

ROOT = 1.5**0.5


class Yang(NamedTuple):
    """Parameters of the law [-]."""

    rate: float = 10.0  #: (c1 = c2) per plastic deviatoric strain; none is given, this is h of [ZK Table 4]
    dilatancy: float = 1.0  #: (w) weight of D; 1 as printed, 0 leaves `li_dafalias`
    critical_fabric: float = 0.48  #: (F_c0) unit in which the law measures F [ZK Table 4]


@law(Yang, "fabric", "plastic")
def increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
    """Return ΔF [ZK Table 1]."""
    u = deviator(plastic)
    volume = plastic[0] + plastic[1] + plastic[2]
    toward = scaled(law.critical_fabric, u)
    return scaled(law.rate, plus(toward, scaled(-length(u) - law.dilatancy * ROOT * volume, fabric)))
