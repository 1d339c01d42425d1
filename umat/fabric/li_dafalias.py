"""Li & Dafalias (2012), Gao et al. (2014), Gao & Zhao (2017): Ḟ = λ̇ c1 (n − c2 F) [ZK Table 1 (iv); K §3.4].

The fabric turns into the loading direction n = ε̇_q^p/‖ε̇_q^p‖ and saturates. Two readings, here and in the laws
of the same family (`woo_salgado`, `yang`, `petalas`):

* a point without a yield surface has no loading index: λ̇ = ‖ε̇_q^p‖ as in [K §3.4], so λ̇ n = ε̇_q^p;
* these authors norm their F to be 1 in the critical state [ZK §3.1; K eq. 6]; ours is F_c0 times theirs, so the law
  reads Ḟ = λ̇ c1 (F_c0 n − c2 F). `critical_fabric` = 1 gives the printed form.

Critical state: F = (F_c0/c2) n. With a constant c2 ‖F‖ rises monotonically; Li & Dafalias let c2 tend to 1 from below,
which Table 1 does not show and is not done here.
"""

from typing import NamedTuple

from .law import deviator, law, length, plus, scaled


class LiDafalias(NamedTuple):
    """Parameters of the law [-]."""

    rate: float = 10.0  #: (c1) per plastic deviatoric strain; none is given, this is h of [ZK Table 4]
    decay: float = 1.0  #: (c2) ‖F‖ ends at critical_fabric / decay [K §3.4]
    critical_fabric: float = 0.48  #: (F_c0) unit in which the law measures F [ZK Table 4]


@law(LiDafalias, "fabric", "plastic")
def increment(law, fabric, stress, state_parameter, ratio, strain, plastic):
    """Return ΔF [ZK Table 1]."""
    u = deviator(plastic)
    toward = scaled(law.critical_fabric, u)
    return scaled(law.rate, plus(toward, scaled(-law.decay * length(u), fabric)))
